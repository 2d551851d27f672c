/* A unit for tests that gives away what it is told: tolerance, start and stop time, whether debug
 * messages are on and of which categories, the length of a file. It says what it does in messages, its
 * label is a text that changes, and it ends its process on demand. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

/* Reals, and Strings */
enum { TOLERANCE, START, STOP, LENGTH, Y, U, CRASH_AT, REALS };
enum { FILE_NAME, LABEL, STRINGS };

typedef struct {
    const callbacks *call;
    char name[64];
    int logging, categories; /* bit 1: logEvents, bit 2: logStatusWarning */
    double real[REALS], time;
    char string[STRINGS][512];
} unit;

static void say(unit *it, status s, const char *category, const char *text)
{
    it->call->log(it->call->environment, it->name, s, category, "%s", text);
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                          const callbacks *call, int visible, int logging)
{
    unit *it = calloc(1, sizeof *it);
    it->call = call;
    strncpy(it->name, name, sizeof it->name - 1);
    it->logging = logging;
    it->categories = logging ? 3 : 0;
    it->real[CRASH_AT] = 1e300;
    strcpy(it->string[LABEL], "not yet");
    return it;
}
void fmi2FreeInstance(component c) { free(c); }
status fmi2SetDebugLogging(component c, int on, size_t n, const char *const names[])
{
    unit *it = c;
    it->logging = on;
    it->categories = on && !n ? 3 : 0;
    for (size_t i = 0; i < n; i++)
        it->categories |= !strcmp(names[i], "logEvents") ? 1 : 2;
    return OK;
}
status fmi2SetupExperiment(component c, int defined, double tolerance, double start, int s,
                           double stop)
{
    unit *it = c;
    it->real[TOLERANCE] = defined ? tolerance : -1;
    it->real[START] = it->time = start;
    it->real[STOP] = s ? stop : -1;
    return OK;
}
status fmi2EnterInitializationMode(component c)
{
    unit *it = c;
    if (it->string[FILE_NAME][0]) {
        FILE *file = fopen(it->string[FILE_NAME], "rb");
        if (!file) {
            say(it, ERROR, "logStatusError", "there is no such file");
            return ERROR;
        }
        fseek(file, 0, SEEK_END);
        it->real[LENGTH] = ftell(file);
        fclose(file);
    }
    return OK;
}
status fmi2ExitInitializationMode(component c) { return OK; }
status fmi2Terminate(component c) { return OK; }
status fmi2Reset(component c) { return OK; }

status fmi2GetReal(component c, const vref *r, size_t n, double *v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->real[r[i]];
    return OK;
}
status fmi2SetReal(component c, const vref *r, size_t n, const double *v)
{
    for (size_t i = 0; i < n; i++)
        ((unit *)c)->real[r[i]] = v[i];
    return OK;
}
status fmi2GetInteger(component c, const vref *r, size_t n, int *v) { return ERROR; }
status fmi2SetInteger(component c, const vref *r, size_t n, const int *v) { return ERROR; }
status fmi2GetBoolean(component c, const vref *r, size_t n, int *v) { return ERROR; }
status fmi2SetBoolean(component c, const vref *r, size_t n, const int *v) { return ERROR; }
status fmi2GetString(component c, const vref *r, size_t n, const char **v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->string[r[i]];
    return OK;
}
status fmi2SetString(component c, const vref *r, size_t n, const char *const *v)
{
    for (size_t i = 0; i < n; i++)
        strncpy(((unit *)c)->string[r[i]], v[i], 511);
    return OK;
}
status fmi2DoStep(component c, double t, double h, int no)
{
    unit *it = c;
    if (t + h >= it->real[CRASH_AT])
        abort();
    it->real[Y] += h * it->real[U];
    it->time = t + h;
    snprintf(it->string[LABEL], 512, it->time < 0.15 ? "at %.1f, \"early\"" : "at %.1f", it->time);
    if (it->categories & 1)
        say(it, OK, "logEvents", "stepped");
    if (it->categories & 2)
        say(it, WARNING, "logStatusWarning", "a debug warning");
    if (it->real[U] < 0)
        say(it, ERROR, "logStatusError", "negative");
    return OK;
}
status fmi2GetFMUstate(component c, void **s) { return ERROR; }
status fmi2SetFMUstate(component c, void *s) { return ERROR; }
status fmi2FreeFMUstate(component c, void **s) { return ERROR; }
status fmi2SerializedFMUstateSize(component c, void *s, size_t *n) { return ERROR; }
status fmi2SerializeFMUstate(component c, void *s, char *b, size_t n) { return ERROR; }
status fmi2DeSerializeFMUstate(component c, const char *b, size_t n, void **s) { return ERROR; }
status fmi2GetDirectionalDerivative(component c, const vref *u, size_t nu, const vref *k, size_t nk,
                                    const double *dk, double *du)
{
    return ERROR;
}
status fmi2SetRealInputDerivatives(component c, const vref *r, size_t n, const int *o,
                                   const double *v)
{
    return ERROR;
}
status fmi2GetRealOutputDerivatives(component c, const vref *r, size_t n, const int *o, double *v)
{
    return ERROR;
}
status fmi2CancelStep(component c) { return ERROR; }
status fmi2GetStatus(component c, int kind, status *v) { return DISCARD; }
status fmi2GetRealStatus(component c, int kind, double *v) { return DISCARD; }
status fmi2GetIntegerStatus(component c, int kind, int *v) { return DISCARD; }
status fmi2GetBooleanStatus(component c, int kind, int *v) { return DISCARD; }
status fmi2GetStringStatus(component c, int kind, const char **v) { return DISCARD; }
