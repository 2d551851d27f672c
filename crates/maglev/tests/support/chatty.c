/* unit.c that logs as it should not. In its first step, with the define FLOOD: so many messages at once;
 * without: one message for each of
 *   from the call, or from a thread of its own,
 *   with its own environment, that of the other instance, 1, 2 or NULL,
 *   with its name, none, or a wrong one.
 * Their texts name all that: "call one none a". With the define REFUSE it cannot be instantiated, and says
 * why with the environment 1 and no name. */
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>

#define fmi2Instantiate honest_fmi2Instantiate
#define fmi2DoStep honest_fmi2DoStep
#include "unit.c"
#undef fmi2Instantiate
#undef fmi2DoStep

#ifndef FLOOD_STATUS
#define FLOOD_STATUS WARNING
#endif

/* of the instances a and b */
static void *environments[2];
static int talked[2];

component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                          const callbacks *call, int visible, int logging)
{
    environments[name[0] == 'b'] = call->environment;
#ifdef REFUSE
    call->log((void *)(uintptr_t)1, NULL, ERROR, "logStatus", "%s has no licence", name);
    return NULL;
#endif
    return honest_fmi2Instantiate(name, type, guid, resources, call, visible, logging);
}

typedef struct {
    unit *it;
    const char *place;
} talk;

static void *all(void *argument)
{
    const talk *t = argument;
    unit *it = t->it;
    int me = it->name[0] == 'b';
    static const char *kinds[] = {"own", "other", "one", "two", "null"};
    void *environment[] = {it->call->environment, environments[!me], (void *)(uintptr_t)1,
                           (void *)(uintptr_t)2, NULL};
    static const char *titles[] = {"right", "none", "wrong"};
    const char *name[] = {it->name, NULL, "nobody"};
    for (int e = 0; e < 5; e++)
        for (int n = 0; n < 3; n++)
            it->call->log(environment[e], name[n], OK, "logAll", "%s %s %s %s", t->place, kinds[e],
                          titles[n], it->name);
    return NULL;
}

status fmi2DoStep(component c, double t, double h, int no)
{
    unit *it = c;
    int me = it->name[0] == 'b';
    if (!talked[me]++) {
#ifdef FLOOD
        for (int k = 0; k < FLOOD; k++)
            it->call->log(it->call->environment, it->name, FLOOD_STATUS, "logAll", "message %d",
                          k);
#else
        talk here = {it, "call"}, there = {it, "thread"};
        pthread_t thread;
        all(&here);
        pthread_create(&thread, NULL, all, &there);
        pthread_join(thread, NULL);
#endif
    }
    return honest_fmi2DoStep(c, t, h, no);
}
