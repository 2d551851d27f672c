/* A unit whose outputs change at communication points only: a step of 12 V at 0.3 s, white noise, a
 * counter, a switch and a mode. Inputs of every type are given back. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef unsigned int vref;
enum { OK, WARNING, DISCARD, ERROR };
enum { STEP, NOISE, REALS };
enum { COUNT, MODE, MODE_IN, MODE_OUT, INTEGERS };

typedef struct {
    double real[REALS];
    int integer[INTEGERS], boolean;
    unsigned seed;
} unit;

static void at(unit *it, double t)
{
    int on = t > 0.3 - 1e-9;
    it->real[STEP] = on ? 12 : 0;
    it->seed = it->seed * 1664525u + 1013904223u;
    it->real[NOISE] = it->seed / 4294967296.0 - 0.5;
    it->integer[COUNT] = on ? 7 : 0;
    it->integer[MODE] = on ? 5 : 1;
    it->boolean = on;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[]) { return OK; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *call, int visible, int logging)
{
    return calloc(1, sizeof(unit));
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int t, double tol, double start, int s, double stop)
{
    ((unit *)c)->seed = 1;
    at(c, start);
    return OK;
}
int fmi2EnterInitializationMode(void *c) { return OK; }
int fmi2ExitInitializationMode(void *c) { return OK; }
int fmi2Terminate(void *c) { return OK; }
int fmi2Reset(void *c) { return OK; }
int fmi2GetReal(void *c, const vref *r, size_t n, double *v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->real[r[i]];
    return OK;
}
int fmi2GetInteger(void *c, const vref *r, size_t n, int *v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->integer[r[i] == MODE_OUT ? MODE_IN : r[i]];
    return OK;
}
int fmi2GetBoolean(void *c, const vref *r, size_t n, int *v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->boolean;
    return OK;
}
int fmi2GetString(void *c, const vref *r, size_t n, const char **v) { return ERROR; }
int fmi2SetReal(void *c, const vref *r, size_t n, const double *v) { return ERROR; }
int fmi2SetInteger(void *c, const vref *r, size_t n, const int *v)
{
    for (size_t i = 0; i < n; i++)
        ((unit *)c)->integer[r[i]] = v[i];
    return OK;
}
int fmi2SetBoolean(void *c, const vref *r, size_t n, const int *v) { return ERROR; }
int fmi2SetString(void *c, const vref *r, size_t n, const char *const *v) { return ERROR; }
int fmi2GetFMUstate(void *c, void **s)
{
    if (!*s)
        *s = malloc(sizeof(unit));
    memcpy(*s, c, sizeof(unit));
    return OK;
}
int fmi2SetFMUstate(void *c, void *s)
{
    memcpy(c, s, sizeof(unit));
    return OK;
}
int fmi2FreeFMUstate(void *c, void **s)
{
    free(*s);
    *s = NULL;
    return OK;
}
int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) { return ERROR; }
int fmi2SerializeFMUstate(void *c, void *s, char *b, size_t n) { return ERROR; }
int fmi2DeSerializeFMUstate(void *c, const char *b, size_t n, void **s) { return ERROR; }
int fmi2GetDirectionalDerivative(void *c, const vref *u, size_t nu, const vref *k, size_t nk,
                                 const double *dk, double *du)
{
    return ERROR;
}
int fmi2SetRealInputDerivatives(void *c, const vref *r, size_t n, const int *o, const double *v)
{
    return ERROR;
}
int fmi2GetRealOutputDerivatives(void *c, const vref *r, size_t n, const int *o, double *v)
{
    return ERROR;
}
int fmi2DoStep(void *c, double t, double h, int no)
{
    at(c, t + h);
    return OK;
}
int fmi2CancelStep(void *c) { return ERROR; }
int fmi2GetStatus(void *c, int kind, int *v) { return DISCARD; }
int fmi2GetRealStatus(void *c, int kind, double *v) { return DISCARD; }
int fmi2GetIntegerStatus(void *c, int kind, int *v) { return DISCARD; }
int fmi2GetBooleanStatus(void *c, int kind, int *v) { return DISCARD; }
int fmi2GetStringStatus(void *c, int kind, const char **v) { return DISCARD; }
