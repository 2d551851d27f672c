/* A unit for tests: an integrator x' = u with exact steps for polynomial inputs, outputs of every
 * type, and faults on demand. Written against the FMI 2.0 standard's text. */
#include <math.h>
#ifdef PRINTS
#include <stdio.h>
#endif
#include <stdlib.h>
#include <string.h>
#ifdef NEEDS_RESOURCES
#include <sys/stat.h>
#endif

#include "fmi2.h"

enum { U, Y, Z, FAIL_TIME, GAIN, REALS };
enum { FAULT, N, M, INTEGERS };

typedef struct {
    const callbacks *call;
    char name[64];
    double real[REALS], derivative[3], time, stop;
    int integer[INTEGERS], boolean[2];
    char string[2][64];
    int pending, dead, running;
} unit;

#ifndef GUID
#define GUID "test-unit"
#endif

static void say(unit *it, status s, const char *text)
{
    it->call->log(it->call->environment, it->name, s, "logStatus", "%s", text);
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
status fmi2SetDebugLogging(component c, int on, size_t n, const char *const names[]) { return OK; }

component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                          const callbacks *call, int visible, int logging)
{
    unit *it;
    if (strcmp(guid, GUID)) {
        call->log(call->environment, name, ERROR, NULL, "GUID %s does not fit, expected %s", guid,
                  GUID);
        return NULL;
    }
#ifdef NEEDS_RESOURCES
    /* the value is a folder below fmuResourceLocation, or empty */
    char folder[4096];
    struct stat found;
    strncpy(folder, resources + strlen("file://"), sizeof folder - 64);
    strcat(folder, NEEDS_RESOURCES);
    if (stat(folder, &found) || !S_ISDIR(found.st_mode)) {
        call->log(call->environment, name, ERROR, NULL, "no folder %s", folder);
        return NULL;
    }
#endif
    it = calloc(1, sizeof *it);
    it->call = call;
    strncpy(it->name, name, sizeof it->name - 1);
    it->real[FAIL_TIME] = 1e300;
    it->real[GAIN] = 1;
    return it;
}

void fmi2FreeInstance(component c)
{
    unit *it = c;
    if (it && it->dead)
        abort(); /* nothing may be called after fmi2Fatal */
    free(c);
}

status fmi2SetupExperiment(component c, int t, double tol, double start, int s, double stop)
{
    ((unit *)c)->time = start;
    ((unit *)c)->stop = s ? stop : INFINITY;
    return OK;
}
status fmi2EnterInitializationMode(component c) { return OK; }
status fmi2ExitInitializationMode(component c)
{
    unit *it = c;
    it->running = 1;
#ifdef LATE /* all outputs have their values only after initialization mode */
    it->real[Y] = LATE;
#endif
    return it->integer[FAULT] == 7 ? ERROR : OK;
}
status fmi2Terminate(component c) { return OK; }
#ifndef WITHOUT_RESET
status fmi2Reset(component c) { return OK; }
#endif

static void outputs(unit *it)
{
    it->real[Z] = it->real[GAIN] * it->real[U];
    it->integer[M] = it->integer[N];
    it->boolean[1] = it->boolean[0];
    strcpy(it->string[1], it->string[0]);
#ifdef LATE
    if (it->running) {
        it->integer[M] = LATE;
        it->boolean[1] = 1;
        strcpy(it->string[1], "late");
    }
#endif
}

status fmi2GetReal(component c, const vref *r, size_t n, double *v)
{
    unit *it = c;
    outputs(it);
    for (size_t i = 0; i < n; i++)
        v[i] = r[i] == Y && it->integer[FAULT] == 1 && it->time >= it->real[FAIL_TIME]
                   ? NAN
                   : it->real[r[i]];
    return OK;
}
status fmi2GetInteger(component c, const vref *r, size_t n, int *v)
{
    outputs(c);
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->integer[r[i]];
    return OK;
}
status fmi2GetBoolean(component c, const vref *r, size_t n, int *v)
{
    outputs(c);
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->boolean[r[i]];
    return OK;
}
status fmi2GetString(component c, const vref *r, size_t n, const char **v)
{
    outputs(c);
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->string[r[i]];
    return OK;
}
status fmi2SetReal(component c, const vref *r, size_t n, const double *v)
{
    for (size_t i = 0; i < n; i++) {
        ((unit *)c)->real[r[i]] = v[i];
        if (r[i] == U)
            memset(((unit *)c)->derivative, 0, sizeof ((unit *)c)->derivative);
    }
    return OK;
}
status fmi2SetInteger(component c, const vref *r, size_t n, const int *v)
{
    for (size_t i = 0; i < n; i++)
        ((unit *)c)->integer[r[i]] = v[i];
    return OK;
}
status fmi2SetBoolean(component c, const vref *r, size_t n, const int *v)
{
    for (size_t i = 0; i < n; i++)
        ((unit *)c)->boolean[r[i]] = v[i];
    return OK;
}
status fmi2SetString(component c, const vref *r, size_t n, const char *const *v)
{
    for (size_t i = 0; i < n; i++)
        strncpy(((unit *)c)->string[r[i]], v[i], 63);
    return OK;
}
/* a state is a copy of the unit; what belongs to this process is left as it is */
status fmi2GetFMUstate(component c, void **s)
{
    if (!*s)
        *s = malloc(sizeof(unit));
    memcpy(*s, c, sizeof(unit));
    return OK;
}
status fmi2SetFMUstate(component c, void *s)
{
    const callbacks *call = ((unit *)c)->call;
    memcpy(c, s, sizeof(unit));
    ((unit *)c)->call = call;
    return OK;
}
status fmi2FreeFMUstate(component c, void **s)
{
    free(*s);
    *s = NULL;
    return OK;
}
status fmi2SerializedFMUstateSize(component c, void *s, size_t *n)
{
    *n = sizeof(unit);
    return OK;
}
status fmi2SerializeFMUstate(component c, void *s, char *b, size_t n)
{
    unit copy = *(unit *)s;
    if (copy.integer[FAULT] == 9) {
        say(c, ERROR, "no bytes today");
        return ERROR;
    }
    copy.call = NULL;
    memcpy(b, &copy, n);
    return OK;
}
status fmi2DeSerializeFMUstate(component c, const char *b, size_t n, void **s)
{
    if (n != sizeof(unit))
        return ERROR;
    *s = malloc(n);
    memcpy(*s, b, n);
    return OK;
}
status fmi2GetDirectionalDerivative(component c, const vref *u, size_t nu, const vref *k, size_t nk,
                                    const double *dk, double *du)
{
    return ERROR;
}
status fmi2SetRealInputDerivatives(component c, const vref *r, size_t n, const int *order,
                                   const double *v)
{
    for (size_t i = 0; i < n; i++) {
        if (r[i] != U || order[i] > MAX_INPUT_ORDER)
            return DISCARD;
        ((unit *)c)->derivative[order[i] - 1] = v[i];
    }
    return OK;
}
status fmi2GetRealOutputDerivatives(component c, const vref *r, size_t n, const int *order,
                                    double *v)
{
    for (size_t i = 0; i < n; i++) {
        if (r[i] != Y || order[i] != 1)
            return DISCARD;
        v[i] = ((unit *)c)->real[U];
    }
    return OK;
}
status fmi2DoStep(component c, double t, double h, int no)
{
    unit *it = c;
    double *u = it->real + U, *d = it->derivative;
#ifdef PRINTS
    puts("printed by the unit");
#endif
#ifdef LARGEST_STEP
    if (h > LARGEST_STEP)
        return DISCARD;
#endif
#ifdef STRICT_STOP /* as 2.1.6 demands it */
    if (t + h > it->stop) {
        say(it, ERROR, "a step beyond the stop time");
        return ERROR;
    }
#endif
#ifdef STRICT_TIME
    if (t != it->time) {
        say(it, ERROR, "a step does not begin where the last one ended");
        return ERROR;
    }
#endif
#ifdef EQUAL_STEPS
    if (h != EQUAL_STEPS && t + EQUAL_STEPS <= it->stop) {
        say(it, ERROR, "a step of another size");
        return ERROR;
    }
#endif
#ifdef SUMS /* y' = u + n + b, and the length of s */
    it->real[Y] += h * (it->integer[N] + it->boolean[0] + strlen(it->string[0]));
#endif
    it->real[Y] += h * (*u + h / 2 * (d[0] + h / 3 * (d[1] + h / 4 * d[2])));
    *u += h * (d[0] + h / 2 * (d[1] + h / 3 * d[2]));
    memset(d, 0, sizeof it->derivative);
    it->time = t + h;
    if (it->time < it->real[FAIL_TIME])
        return OK;
    switch (it->integer[FAULT]) {
    case 2: say(it, WARNING, "#r0# is odd at 100 ##"); return WARNING;
    case 3: return DISCARD;
    case 4: say(it, ERROR, "the model broke"); return ERROR;
    case 5: it->dead = 1; return FATAL;
    case 6: it->pending = 3; return PENDING;
    case 8: return 99;
    case 10: abort();
    case 11: for (;;);
    default: return OK;
    }
}
status fmi2CancelStep(component c) { return ERROR; }
status fmi2GetStatus(component c, int kind, status *v)
{
    *v = ((unit *)c)->pending-- > 0 ? PENDING : OK;
    return OK;
}
status fmi2GetRealStatus(component c, int kind, double *v)
{
    *v = ((unit *)c)->time - 0.001;
    return OK;
}
status fmi2GetIntegerStatus(component c, int kind, int *v) { return DISCARD; }
status fmi2GetBooleanStatus(component c, int kind, int *v)
{
#ifdef LARGEST_STEP
    *v = 0;
#else
    *v = kind == 3;
#endif
    return OK;
}
status fmi2GetStringStatus(component c, int kind, const char **v) { return DISCARD; }
