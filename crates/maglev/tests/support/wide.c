/* A unit with as many Real outputs as its description says: output r is (r + 1)·t. */
#include <stddef.h>
#include <stdlib.h>

typedef unsigned int vref;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[]) { return 0; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *call, int visible, int logging)
{
    return calloc(1, sizeof(double));
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int t, double tol, double start, int s, double stop)
{
    *(double *)c = start;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { return 0; }
int fmi2ExitInitializationMode(void *c) { return 0; }
int fmi2Terminate(void *c) { return 0; }
int fmi2Reset(void *c) { return 0; }
int fmi2GetReal(void *c, const vref *r, size_t n, double *v)
{
    for (size_t i = 0; i < n; i++)
        v[i] = (r[i] + 1) * *(double *)c;
    return 0;
}
int fmi2SetReal(void *c, const vref *r, size_t n, const double *v) { return 0; }
int fmi2DoStep(void *c, double t, double h, int no)
{
    *(double *)c = t + h;
    return 0;
}
