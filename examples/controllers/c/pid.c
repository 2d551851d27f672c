/* A controller of your own for a levitation magnet, as an FMI 2.0 co-simulation unit: one file of C, no headers but the
 * standard library's.
 *
 *     sh build.sh        # compiles and packs pid.fmu
 *
 * A digital PID controller on the gap's deviation e, with feedback of the acceleration q" against the girder's motion:
 *
 *     v = kp e + ki * integral of e + kd * rate of the gap + ka q"        in V, beyond the magnet's operating point
 *
 * It takes a sample at the start of each communication step; the voltage acts from the end of that step on and is held for
 * one step: a digital controller whose computing takes one sample. The integral brings the gap back to set_point under any
 * load. Your own law goes into `control` and `advance`; a variable more goes into the list of value references, into START
 * and into modelDescription.xml. What is not about the law begins at "The FMI functions". */

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Types of FMI 2.0 (fmi2TypesPlatform.h, fmi2FunctionTypes.h), as far as they are used here. */
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean, fmi2Type, fmi2StatusKind;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* ---- The controller ---------------------------------------------------------------------------------------------- */

#define GUID "{6f1c1f0e-5f52-4d0c-9e0b-6d8c5a7e1b01}" /* as in modelDescription.xml; a new one after every change there */

/* Value references, as in modelDescription.xml. */
enum { GAP, GAP_RATE, ACCELERATION, VOLTAGE, TRANSIENT_VOLTAGE, SET_POINT, KP, KI, KD, KA, COUNT };
enum { LAST_INPUT = ACCELERATION, LAST_OUTPUT = TRANSIENT_VOLTAGE };

static const double START[COUNT] = {0.008, 0, 0, 0, 0, 0.008, 4000, 2000, 300, 4};

/* Everything that changes: saving a state is copying this. */
typedef struct {
    double real[COUNT]; /* the variables, by value reference */
    double integral;    /* of the gap's deviation, m s */
    double time;        /* of the last communication point, s */
} State;

/* The voltage for the inputs now and an acceleration. */
static void control(State *it, double acceleration)
{
    const double *v = it->real;
    double deviation = v[GAP] - v[SET_POINT];
    it->real[VOLTAGE] = v[KP] * deviation + v[KI] * it->integral + v[KD] * v[GAP_RATE] + v[KA] * acceleration;
}

/* The start: at rest, so without the acceleration, which would depend on the voltage. The coil shall not take the part of the
 * gap's rate for lasting. */
static void initialize(State *it)
{
    it->integral = 0;
    control(it, 0);
    it->real[TRANSIENT_VOLTAGE] = it->real[KD] * it->real[GAP_RATE];
}

/* One communication step of h seconds: the sample is that of its start. */
static void advance(State *it, double h)
{
    control(it, it->real[ACCELERATION]);
    it->integral += h * (it->real[GAP] - it->real[SET_POINT]);
}

/* What is wrong with the parameters, or NULL. */
static const char *fault(const State *it)
{
    return it->real[SET_POINT] > 0 ? NULL : "set_point must be positive: it is the air gap in m";
}

/* ---- The FMI functions: the same for every controller ------------------------------------------------------------- */

typedef struct {
    State now;
    fmi2CallbackFunctions call;
    char name[256];
    double stop; /* time, s */
    int running; /* 0 created, 1 initializing, 2 stepping, 3 terminated */
} Unit;

static fmi2Status fail(Unit *it, const char *text)
{
    if (it->call.logger) it->call.logger(it->call.environment, it->name, fmi2Error, "logStatusError", "%s", text);
    return fmi2Error;
}

static void restart(Unit *it)
{
    memset(&it->now, 0, sizeof it->now);
    memcpy(it->now.real, START, sizeof START);
    it->stop = INFINITY;
    it->running = 0;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *call, fmi2Boolean visible, fmi2Boolean logging)
{
    Unit *it = call && name && *name ? calloc(1, sizeof *it) : NULL;
    (void)resources, (void)visible, (void)logging;
    if (!it) return NULL;
    it->call = *call;
    snprintf(it->name, sizeof it->name, "%s", name);
    restart(it);
    if (type == 1 && guid && !strcmp(guid, GUID)) return it; /* 1: co-simulation */
    fail(it, type == 1 ? "the GUID is not that of this library" : "only co-simulation is possible");
    free(it);
    return NULL;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    (void)on, (void)n, (void)names;
    return c ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean stop_defined, fmi2Real stop)
{
    Unit *it = c;
    (void)tolerance_defined, (void)tolerance;
    if (!it) return fmi2Error;
    if (it->running != 0) return fail(it, "fmi2SetupExperiment comes before initialization");
    if (!isfinite(start) || (stop_defined && !(stop >= start))) return fail(it, "invalid start or stop time");
    it->now.time = start;
    if (stop_defined) it->stop = stop;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Unit *it = c;
    if (!it) return fmi2Error;
    if (it->running != 0) return fail(it, "the unit is initialized already");
    it->running = 1;
    return fmi2OK;
}

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Unit *it = c;
    if (!it) return fmi2Error;
    if (it->running != 1) return fail(it, "fmi2EnterInitializationMode comes first");
    if (fault(&it->now)) return fail(it, fault(&it->now));
    initialize(&it->now);
    it->running = 2;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    Unit *it = c;
    if (!it) return fmi2Error;
    if (it->running != 2) return fail(it, "fmi2Terminate is allowed once, after initialization");
    it->running = 3;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    if (!c) return fmi2Error;
    restart(c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    Unit *it = c;
    if (!it || (n && (!vr || !value))) return fmi2Error;
    if (it->running == 1) initialize(&it->now);
    for (size_t k = 0; k < n; k++)
        if (vr[k] >= COUNT) return fail(it, "no Real has this value reference");
        else value[k] = it->now.real[vr[k]];
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    Unit *it = c;
    if (!it || (n && (!vr || !value))) return fmi2Error;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= COUNT) return fail(it, "no Real has this value reference");
        if (vr[k] > LAST_INPUT && vr[k] <= LAST_OUTPUT) return fail(it, "outputs cannot be set");
        if (vr[k] == SET_POINT && it->running > 1) return fail(it, "set_point is fixed after initialization");
        if (!isfinite(value[k])) return fail(it, "values must be finite");
    }
    if (it->running == 3) return fail(it, "the unit is terminated");
    for (size_t k = 0; k < n; k++) it->now.real[vr[k]] = value[k];
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_way_back)
{
    Unit *it = c;
    (void)no_way_back;
    if (!it) return fmi2Error;
    if (it->running != 2) return fail(it, "fmi2DoStep comes after initialization");
    if (!isfinite(time) || !(h > 0) || !isfinite(h)) return fail(it, "invalid time or step size");
    if (fabs(time - it->now.time) > 1e-6 * h) return fail(it, "the step does not start where the last one ended");
    if (time + h > it->stop + 1e-6 * h) return fail(it, "the step ends after the stop time");
    advance(&it->now, h);
    it->now.time = time + h;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!c || !state) return fmi2Error;
    if (!*state) *state = malloc(sizeof(Unit));
    if (!*state) return fail(c, "no memory for the state");
    memcpy(*state, c, sizeof(Unit));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    if (!c || !state) return fmi2Error;
    ((Unit *)c)->now = ((Unit *)state)->now;
    ((Unit *)c)->running = ((Unit *)state)->running;
    return fmi2OK;
}

EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!c) return fmi2Error;
    if (state) free(*state), *state = NULL;
    return fmi2OK;
}

/* The remaining functions of the standard, which this unit does not offer. */
#define NONE(name, ...)                                                                                                  \
    EXPORT fmi2Status name(fmi2Component c, __VA_ARGS__) { return c ? fail(c, #name " is not offered") : fmi2Error; }
#define NO_VARIABLES(type)                                                                                               \
    EXPORT fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##type value[])        \
    {                                                                                                                    \
        (void)vr, (void)value;                                                                                           \
        return !c ? fmi2Error : n ? fail(c, "there are no variables of type " #type) : fmi2OK;                           \
    }                                                                                                                    \
    EXPORT fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##type value[])  \
    {                                                                                                                    \
        (void)vr, (void)value;                                                                                           \
        return !c ? fmi2Error : n ? fail(c, "there are no variables of type " #type) : fmi2OK;                           \
    }
NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
NONE(fmi2SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
NONE(fmi2SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
NONE(fmi2DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
NONE(fmi2GetDirectionalDerivative, const fmi2ValueReference of[], size_t m, const fmi2ValueReference by[], size_t n,
     const fmi2Real seed[], fmi2Real value[])
NONE(fmi2SetRealInputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
     const fmi2Real value[])
NONE(fmi2GetRealOutputDerivatives, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[], fmi2Real value[])
/* Steps are never pending, so there is no status to ask for. */
#define NO_STATUS(name, type)                                                                                            \
    EXPORT fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value) { return c ? fmi2Discard : fmi2Error; }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetRealStatus, fmi2Real)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)
EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { return c ? fail(c, "fmi2CancelStep is not offered") : fmi2Error; }
