/* x' = v, v' = -100 x - 2 v + u; y = x, w = v + 0.5 u. With SAMPLED, u is taken at every third step of 10 ms
 * only and held in between. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef unsigned int vref;
enum { OK, WARNING, DISCARD, ERROR };
enum { X, V, U, Y, W, DX, DV };

typedef struct {
    double x, v, u, held;
    int steps;
} unit;

#ifdef SAMPLED
#define FED(it) ((it)->held)
#else
#define FED(it) ((it)->u)
#endif

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[]) { return OK; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *call, int visible, int logging)
{
    return calloc(1, sizeof(unit));
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int t, double tol, double start, int s, double stop) { return OK; }
int fmi2EnterInitializationMode(void *c) { return OK; }
int fmi2ExitInitializationMode(void *c) { return OK; }
int fmi2Terminate(void *c) { return OK; }
int fmi2Reset(void *c) { return OK; }
int fmi2GetReal(void *c, const vref *r, size_t n, double *v)
{
    unit *it = c;
    for (size_t i = 0; i < n; i++) {
        double all[] = { it->x, it->v, it->u, it->x, it->v + 0.5 * FED(it), it->v,
                         -100 * it->x - 2 * it->v + FED(it) };
        v[i] = all[r[i]];
    }
    return OK;
}
int fmi2GetInteger(void *c, const vref *r, size_t n, int *v) { return ERROR; }
int fmi2GetBoolean(void *c, const vref *r, size_t n, int *v) { return ERROR; }
int fmi2GetString(void *c, const vref *r, size_t n, const char **v) { return ERROR; }
int fmi2SetReal(void *c, const vref *r, size_t n, const double *v)
{
    for (size_t i = 0; i < n; i++) {
        if (r[i] != U)
            return ERROR;
        ((unit *)c)->u = v[i];
    }
    return OK;
}
int fmi2SetInteger(void *c, const vref *r, size_t n, const int *v) { return ERROR; }
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
/* rows: Y, W, DX, DV; columns: X, V, U */
static double slope(vref of, vref by)
{
    static const double y[] = { 1, 0, 0 }, w[] = { 0, 1, 0.5 }, dx[] = { 0, 1, 0 }, dv[] = { -100, -2, 1 };
    switch (of) {
    case Y: return y[by];
    case W: return w[by];
    case DX: return dx[by];
    default: return dv[by];
    }
}
int fmi2GetDirectionalDerivative(void *c, const vref *u, size_t nu, const vref *k, size_t nk,
                                 const double *dk, double *du)
{
    for (size_t i = 0; i < nu; i++) {
        du[i] = 0;
        for (size_t j = 0; j < nk; j++)
            du[i] += slope(u[i], k[j]) * dk[j];
    }
    return OK;
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
    enum { PARTS = 100 };
    unit *it = c;
    if (it->steps++ % 3 == 0)
        it->held = it->u;
    double d = h / PARTS, u = FED(it);
    for (int k = 0; k < PARTS; k++) {
        double x1 = it->v, v1 = -100 * it->x - 2 * it->v + u;
        double xm = it->x + d / 2 * x1, vm = it->v + d / 2 * v1;
        double x2 = vm, v2 = -100 * xm - 2 * vm + u;
        it->x += d * x2;
        it->v += d * v2;
    }
    return OK;
}
int fmi2CancelStep(void *c) { return ERROR; }
int fmi2GetStatus(void *c, int kind, int *v) { return DISCARD; }
int fmi2GetRealStatus(void *c, int kind, double *v) { return DISCARD; }
int fmi2GetIntegerStatus(void *c, int kind, int *v) { return DISCARD; }
int fmi2GetBooleanStatus(void *c, int kind, int *v) { return DISCARD; }
int fmi2GetStringStatus(void *c, int kind, const char **v) { return DISCARD; }
