/* An integrator y' = u with z = gain * u fed through, that breaks where units of widespread exporters
 * break, and writes down its calls. The environment names the file: CALLS. What it does is chosen when it
 * is compiled, each by a status (0 fmi2OK, 1 fmi2Warning, 2 fmi2Discard, 3 fmi2Error):
 *   ORDER1, ORDER2         to derivatives of inputs of order 1, and above
 *   EMPTY                  to directional derivatives of nothing, or by nothing
 *   OUTPUT_DERIVATIVES, DIRECTIONAL, STATES   to these calls altogether
 *   DEAD                   to every step after it has broken, and to every other call if it is 3
 *   DIES                   after so many steps it breaks by itself
 *   LAST_WORDS             what it says when it breaks
 * A unit that has broken stands still. One that has returned fmi2Warning to order 2 (not broken) ignores
 * from then on every call that mixes orders. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

#ifndef ORDER1
#define ORDER1 OK
#endif
#ifndef ORDER2
#define ORDER2 ERROR
#endif
#ifndef EMPTY
#define EMPTY ERROR
#endif
#ifndef OUTPUT_DERIVATIVES
#define OUTPUT_DERIVATIVES OK
#endif
#ifndef DIRECTIONAL
#define DIRECTIONAL OK
#endif
#ifndef STATES
#define STATES OK
#endif
#ifndef DEAD
#define DEAD ERROR
#endif
#ifndef DIES
#define DIES 1000000
#endif
#ifndef LAST_WORDS
#define LAST_WORDS "simulation terminated"
#endif

enum { U, Y, Z, GAIN, REALS };

typedef struct {
    const callbacks *call;
    char name[64];
    double real[REALS], derivative[3];
    int broken, deaf, steps;
} unit;

static void record(unit *it, const char *text)
{
    const char *name = getenv("CALLS");
    FILE *file = name ? fopen(name, "a") : NULL;
    if (file) {
        fprintf(file, "%s %s\n", it->name, text);
        fclose(file);
    }
}

static void record_list(unit *it, const char *call, const vref *r, size_t n, const int *order)
{
    char text[512];
    size_t at = snprintf(text, sizeof text, "%s", call);
    for (size_t i = 0; i < n; i++) {
        at += snprintf(text + at, sizeof text - at, " %u", r[i]);
        if (order)
            at += snprintf(text + at, sizeof text - at, ":%d", order[i]);
    }
    record(it, text);
}

static void say(unit *it, status s, const char *text)
{
    it->call->log(it->call->environment, it->name, s, "logStatus", "%s", text);
}

/* breaks on an error, and answers */
static status answer(unit *it, status s)
{
    if (s == ERROR && !it->broken) {
        it->broken = 1;
        say(it, ERROR, LAST_WORDS);
    }
    if (s == WARNING || s == DISCARD)
        say(it, s, "not supported");
    return s;
}

#define BROKEN(it)                                                                                 \
    if ((it)->broken && DEAD == ERROR)                                                             \
        return ERROR;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
status fmi2SetDebugLogging(component c, int on, size_t n, const char *const names[])
{
    record(c, "fmi2SetDebugLogging");
    return OK;
}

component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                          const callbacks *call, int visible, int logging)
{
    unit *it = calloc(1, sizeof *it);
    it->call = call;
    it->real[GAIN] = 1;
    strncpy(it->name, name, sizeof it->name - 1);
    record(it, "fmi2Instantiate");
    return it;
}
void fmi2FreeInstance(component c)
{
    if (c)
        record(c, "fmi2FreeInstance");
    free(c);
}

#define PLAIN(function, parameters)                                                                \
    status function parameters                                                                     \
    {                                                                                              \
        record(c, #function);                                                                      \
        BROKEN((unit *)c)                                                                          \
        return OK;                                                                                 \
    }
PLAIN(fmi2SetupExperiment, (component c, int t, double tol, double start, int s, double stop))
PLAIN(fmi2EnterInitializationMode, (component c))
PLAIN(fmi2ExitInitializationMode, (component c))
PLAIN(fmi2Terminate, (component c))
PLAIN(fmi2Reset, (component c))
PLAIN(fmi2GetInteger, (component c, const vref *r, size_t n, int *v))
PLAIN(fmi2GetBoolean, (component c, const vref *r, size_t n, int *v))
PLAIN(fmi2GetString, (component c, const vref *r, size_t n, const char **v))
PLAIN(fmi2SetInteger, (component c, const vref *r, size_t n, const int *v))
PLAIN(fmi2SetBoolean, (component c, const vref *r, size_t n, const int *v))
PLAIN(fmi2SetString, (component c, const vref *r, size_t n, const char *const *v))
PLAIN(fmi2CancelStep, (component c))
PLAIN(fmi2GetStatus, (component c, int kind, status *v))
PLAIN(fmi2GetRealStatus, (component c, int kind, double *v))
PLAIN(fmi2GetIntegerStatus, (component c, int kind, int *v))
PLAIN(fmi2GetBooleanStatus, (component c, int kind, int *v))
PLAIN(fmi2GetStringStatus, (component c, int kind, const char **v))
PLAIN(fmi2SerializedFMUstateSize, (component c, void *s, size_t *n))
PLAIN(fmi2SerializeFMUstate, (component c, void *s, char *b, size_t n))
PLAIN(fmi2DeSerializeFMUstate, (component c, const char *b, size_t n, void **s))

status fmi2GetReal(component c, const vref *r, size_t n, double *v)
{
    unit *it = c;
    record_list(it, "fmi2GetReal", r, n, NULL);
    BROKEN(it)
    if (!it->broken)
        it->real[Z] = it->real[GAIN] * it->real[U];
    for (size_t i = 0; i < n; i++)
        v[i] = it->real[r[i]];
    return OK;
}
status fmi2SetReal(component c, const vref *r, size_t n, const double *v)
{
    unit *it = c;
    record_list(it, "fmi2SetReal", r, n, NULL);
    BROKEN(it)
    for (size_t i = 0; i < n; i++)
        it->real[r[i]] = v[i];
    return OK;
}
status fmi2GetFMUstate(component c, void **s)
{
    record(c, "fmi2GetFMUstate");
    BROKEN((unit *)c)
    if (STATES != OK)
        return answer(c, STATES);
    if (!*s)
        *s = malloc(sizeof(unit));
    memcpy(*s, c, sizeof(unit));
    return OK;
}
status fmi2SetFMUstate(component c, void *s)
{
    record(c, "fmi2SetFMUstate");
    BROKEN((unit *)c)
    memcpy(c, s, sizeof(unit));
    return OK;
}
status fmi2FreeFMUstate(component c, void **s)
{
    free(*s);
    *s = NULL;
    return OK;
}
status fmi2GetDirectionalDerivative(component c, const vref *u, size_t nu, const vref *k, size_t nk,
                                    const double *dk, double *du)
{
    unit *it = c;
    char text[64];
    snprintf(text, sizeof text, "fmi2GetDirectionalDerivative %zu/%zu", nu, nk);
    record(it, text);
    BROKEN(it)
    if (!nu || !nk)
        return answer(it, EMPTY);
    if (DIRECTIONAL != OK)
        return answer(it, DIRECTIONAL);
    for (size_t i = 0; i < nu; i++) {
        du[i] = 0;
        for (size_t j = 0; j < nk; j++)
            du[i] += u[i] == Z && k[j] == U ? it->real[GAIN] * dk[j] : 0;
    }
    return OK;
}
status fmi2SetRealInputDerivatives(component c, const vref *r, size_t n, const int *order,
                                   const double *v)
{
    unit *it = c;
    int mixed = 0, high = 0;
    record_list(it, "fmi2SetRealInputDerivatives", r, n, order);
    BROKEN(it)
    for (size_t i = 0; i < n; i++) {
        mixed |= order[i] != order[0];
        high |= order[i] > 1;
    }
    if (high && ORDER2 != OK) {
        it->deaf |= ORDER2 == WARNING;
        return answer(it, ORDER2);
    }
    if (ORDER1 != OK)
        return answer(it, ORDER1);
    if (it->deaf && mixed)
        return OK;
    for (size_t i = 0; i < n; i++)
        it->derivative[order[i] - 1] = v[i];
    return OK;
}
status fmi2GetRealOutputDerivatives(component c, const vref *r, size_t n, const int *order,
                                    double *v)
{
    unit *it = c;
    record_list(it, "fmi2GetRealOutputDerivatives", r, n, order);
    BROKEN(it)
    if (OUTPUT_DERIVATIVES != OK)
        return answer(it, OUTPUT_DERIVATIVES);
    for (size_t i = 0; i < n; i++)
        v[i] = r[i] == Y && order[i] == 1 ? it->real[U] : 0;
    return OK;
}
status fmi2DoStep(component c, double t, double h, int no)
{
    unit *it = c;
    double *u = it->real + U, *d = it->derivative;
    record(it, "fmi2DoStep");
    if (++it->steps > DIES && !it->broken) {
        it->broken = 1;
        if (*LAST_WORDS)
            say(it, WARNING, LAST_WORDS);
    }
    if (it->broken)
        return DEAD;
    it->real[Y] += h * (*u + h / 2 * (d[0] + h / 3 * (d[1] + h / 4 * d[2])));
    *u += h * (d[0] + h / 2 * (d[1] + h / 3 * d[2]));
    memset(d, 0, sizeof it->derivative);
    return OK;
}
