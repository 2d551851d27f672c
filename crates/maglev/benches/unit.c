/* A unit as small as units get, for measuring what the master adds: PORTS first-order lags,
 * y' = u - y, stepped exactly. Value references: inputs 0 .. PORTS-1, outputs from PORTS on. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#ifndef PORTS
#define PORTS 1
#endif

typedef struct {
    double value[2 * PORTS], size, decay;
} unit;
typedef unsigned int vref;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[]) { return 0; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *callbacks, int visible, int logging)
{
    unit *it = calloc(1, sizeof *it);
    for (int k = 0; k < PORTS; k++)
        it->value[PORTS + k] = 1 + k;
    return it;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int t, double tolerance, double start, int s, double stop) { return 0; }
int fmi2EnterInitializationMode(void *c) { return 0; }
int fmi2ExitInitializationMode(void *c) { return 0; }
int fmi2Terminate(void *c) { return 0; }
int fmi2Reset(void *c) { return 0; }
int fmi2GetReal(void *c, const vref *r, size_t n, double *v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = ((unit *)c)->value[r[i]];
    return 0;
}
int fmi2SetReal(void *c, const vref *r, size_t n, const double *v)
{
    for (size_t i = 0; i < n; i++)
        ((unit *)c)->value[r[i]] = v[i];
    return 0;
}
#define NONE(type) \
    int fmi2Get##type(void *c, const vref *r, size_t n, void *v) { return n ? 3 : 0; } \
    int fmi2Set##type(void *c, const vref *r, size_t n, const void *v) { return n ? 3 : 0; }
NONE(Integer)
NONE(Boolean)
NONE(String)
int fmi2GetFMUstate(void *c, void **s) { return 3; }
int fmi2SetFMUstate(void *c, void *s) { return 3; }
int fmi2FreeFMUstate(void *c, void **s) { return 3; }
int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) { return 3; }
int fmi2SerializeFMUstate(void *c, void *s, char *b, size_t n) { return 3; }
int fmi2DeSerializeFMUstate(void *c, const char *b, size_t n, void **s) { return 3; }
int fmi2GetDirectionalDerivative(void *c, const vref *u, size_t nu, const vref *k, size_t nk,
                                 const double *dk, double *du) { return 3; }
int fmi2SetRealInputDerivatives(void *c, const vref *r, size_t n, const int *o, const double *v) { return 3; }
int fmi2GetRealOutputDerivatives(void *c, const vref *r, size_t n, const int *o, double *v) { return 3; }
int fmi2DoStep(void *c, double t, double h, int no)
{
    unit *it = c;
    if (h != it->size) {
        it->size = h;
        it->decay = exp(-h);
    }
    for (int k = 0; k < PORTS; k++)
        it->value[PORTS + k] = it->value[k] + it->decay * (it->value[PORTS + k] - it->value[k]);
    return 0;
}
int fmi2CancelStep(void *c) { return 3; }
int fmi2GetStatus(void *c, int kind, int *v) { return 2; }
int fmi2GetRealStatus(void *c, int kind, double *v) { return 2; }
int fmi2GetIntegerStatus(void *c, int kind, int *v) { return 2; }
int fmi2GetBooleanStatus(void *c, int kind, int *v) { return 2; }
int fmi2GetStringStatus(void *c, int kind, const char **v) { return 2; }
