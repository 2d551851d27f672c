/* A sound co-simulation unit that keeps FMI 2.0 to the letter, and, by -DFAULT=n, one that breaks it
 * in one way: the conformance suite must find each. Model: x' = u - x, y = x, z = gain u + x.
 * Written against the FMI 2.0 standard's text. */
#define _GNU_SOURCE
#include <fenv.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2.h"

/* the faults, in the order of the suite's checks; conformance.rs names them */
enum {
    SOUND, LOAD, RUN, FINITE, REPEATABLE, FREE_ANY_TIME, FREE_NULL, TERMINATE_TWICE, RESET,
    START_TIME, ORDER_ALLOWED, ORDER_FORBIDDEN, AFTER_ERROR, ZERO_LENGTH, NULL_ARGUMENTS,
    WRONG_REFERENCE, READ_ONLY, CALCULATED, FIXED_LATE, GUID_WRONG, NAME_NULL, MODEL_EXCHANGE,
    STATUS_KINDS, START_VALUES, SET_THEN_GET, STRINGS, BOOLEANS, VALUE_RANGE, INDEPENDENT,
    DEPENDENCIES, LOCATION_FORMS, LOCATION_ODD, LOGGER_CALLER, LOGGER_CATEGORY, LOGGER_OFF,
    LOGGER_FORMAT, LOGGER_ERROR, LOGGER_CONTROL, SILENT, PROCESS_STATE, MEMORY_INSTANCES,
    MEMORY_STEPS, MEMORY_STATES, MANY_INSTANCES, THREADS, STEP_VARYING, STEP_EXTREME, STEP_SPLIT,
    STEP_ROUNDED, STEP_INVALID, STEP_NOT_FINITE, STEP_ELSEWHERE, STEP_PAST_STOP, INPUTS_EXTREME, STATE_RESTORED,
    STATE_INPUTS, STATE_INDEPENDENT, STATE_MEMORY, SERIALIZED, SERIALIZED_PROCESS,
    SERIALIZED_DAMAGED, INPUT_DERIVATIVES, INPUT_DERIVATIVES_WRONG, OUTPUT_DERIVATIVES,
    DIRECTIONAL,
    /* no finding of one check, but ends of the process that every check must survive */
    CRASH, HANG, EXIT
};
#ifndef FAULT
#define FAULT SOUND
#endif
static const int fault = FAULT;

enum { NEW, SET_UP, INITIALIZING, STEPPING, ENDED, BROKEN };
enum { U, Y, Z, X0, FIXED, GAIN, CONSTANT, TIME, REAL_COUNT };
enum { N, M, INTEGER_COUNT };
enum { B, C, BOOLEAN_COUNT };
enum { S, T, STRING_COUNT };

typedef struct {
    double real[REAL_COUNT], slope, state, now, stop;
    int integer[INTEGER_COUNT], boolean[BOOLEAN_COUNT], mode, stop_defined;
    char string[STRING_COUNT][64];
} values;

typedef struct {
    callbacks call;
    char name[128];
    int logging, steps;
    values v;
} unit;

static values shared; /* what must not be shared */
static int instances;

static void say(unit *it, status s, const char *category, const char *text)
{
    char escaped[400];
    char *to = escaped;

    if (s == OK && !it->logging && fault != LOGGER_OFF)
        return;
    for (; *text && to < escaped + sizeof escaped - 3; text++) {
        if (*text == '%' && fault != LOGGER_FORMAT)
            *to++ = '%';
        *to++ = *text;
    }
    *to = 0;
    if (fault == LOGGER_CATEGORY)
        category = "undeclared";
    if (fault == LOGGER_CALLER)
        it->call.log(NULL, it->name, s, category, escaped);
    else
        it->call.log(it->call.environment, it->name, s, category, escaped);
}

static status fail(unit *it, const char *text)
{
    it->v.mode = BROKEN;
    if (fault != LOGGER_ERROR)
        say(it, ERROR, "logStatusError", text);
    return ERROR;
}

static void leak(void)
{
    static char *volatile place; /* volatile, or the compiler sees that nobody looks */
    place = malloc(20000);
    if (place)
        memset(place, 1, 20000);
}

static int is_there(unit *it) { return it != NULL; }

static void begin(unit *it)
{
    memset(&it->v, 0, sizeof it->v);
    it->v.real[U] = fault == START_VALUES ? 2 : 1;
    it->v.real[X0] = 0.5;
    it->v.real[FIXED] = 3;
    it->v.real[GAIN] = 2;
    it->v.real[CONSTANT] = 42;
    strcpy(it->v.string[S], "start");
}

static void outputs(unit *it)
{
    values *v = &it->v;
    if (v->mode <= INITIALIZING)
        v->state = v->real[X0];
    v->real[Y] = v->state;
    v->real[Z] = v->real[GAIN] * v->real[U] + v->state;
    if (fault == DEPENDENCIES)
        v->real[Y] += v->real[U];
    if (fault == VALUE_RANGE)
        v->real[Y] -= 1000;
    if (fault == FINITE && v->mode == STEPPING)
        v->real[Z] = NAN;
    v->real[TIME] = fault == INDEPENDENT ? 0 : v->now;
    v->integer[M] = v->integer[N];
    v->boolean[C] = v->boolean[B];
    if (fault == BOOLEANS)
        v->boolean[C] = 2;
    strcpy(v->string[T], v->string[S]);
}

#ifndef WITHOUT_PLATFORM
const char *fmi2GetTypesPlatform(void) { return "default"; }
#endif
const char *fmi2GetVersion(void) { return "2.0"; }

status fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[])
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (fault == LOGGER_CONTROL && n == 0 && !on)
        return fail(it, "no");
    for (size_t i = 0; i < n; i++) {
        if (!names || !names[i] || strcmp(names[i], "logStatusError")) {
            char text[200];
            snprintf(text, sizeof text, "unknown category %s", names && names[i] ? names[i] : "");
            return fail(it, text);
        }
    }
    it->logging = on;
    return OK;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const callbacks *call, int visible, int logging)
{
    unit *it;
    char text[300];

    if (fault == LOCATION_ODD && !resources)
        abort();
    if (fault == LOCATION_FORMS && (!resources || strncmp(resources, "file:///", 8)))
        return NULL;
    if (!call || (fault != NAME_NULL && (!name || !*name || !guid)) ||
        (type != 1 && fault != MODEL_EXCHANGE))
        return NULL;
    if (guid && strcmp(guid, "conformance-unit") && fault != GUID_WRONG) {
        unit none;
        memset(&none, 0, sizeof none);
        none.call = *call;
        strncpy(none.name, name, sizeof none.name - 1);
        snprintf(text, sizeof text, "the GUID %s is not mine", guid);
        say(&none, ERROR, "logStatusError", text);
        return NULL;
    }
    it = calloc(1, sizeof *it);
    if (!it)
        return NULL;
    it->call = *call;
    strncpy(it->name, name ? name : "", sizeof it->name - 1);
    it->logging = logging;
    begin(it);
    instances++;
    if (fault == REPEATABLE)
        it->v.real[GAIN] += 1e-9 * instances;
    if (fault == PROCESS_STATE)
        fesetround(FE_UPWARD);
    if (fault == MEMORY_INSTANCES)
        leak();
    return it;
}

void fmi2FreeInstance(void *c)
{
    unit *it = c;
    if (fault == FREE_NULL && !it)
        abort();
    if (!it)
        return;
    if (fault == FREE_ANY_TIME && it->v.mode == INITIALIZING)
        abort();
    free(it);
}

status fmi2SetupExperiment(void *c, int t, double tolerance, double start, int s, double stop)
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (it->v.mode > SET_UP)
        return fail(it, "fmi2SetupExperiment is late");
    if (fault == START_TIME && start > 0.5)
        return fail(it, "this unit begins at 0");
    it->v.now = start;
    it->v.stop = stop;
    it->v.stop_defined = s;
    it->v.mode = SET_UP;
    return OK;
}

status fmi2EnterInitializationMode(void *c)
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (it->v.mode != SET_UP && fault != ORDER_FORBIDDEN)
        return fail(it, "fmi2EnterInitializationMode out of order");
    it->v.mode = INITIALIZING;
    outputs(it);
    return OK;
}

status fmi2ExitInitializationMode(void *c)
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (it->v.mode != INITIALIZING)
        return fail(it, "fmi2ExitInitializationMode out of order");
    outputs(it);
    it->v.mode = STEPPING;
    say(it, OK, "logStatusError", "initialized");
    return OK;
}

status fmi2Terminate(void *c)
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (fault == TERMINATE_TWICE && it->v.mode == ENDED)
        abort();
    if (it->v.mode != STEPPING)
        return fail(it, "fmi2Terminate out of order");
    it->v.mode = ENDED;
    return OK;
}

status fmi2Reset(void *c)
{
    unit *it = c;
    double input;
    if (!is_there(it))
        return ERROR;
    input = it->v.real[X0];
    begin(it);
    it->steps = 0;
    if (fault == RESET)
        it->v.real[X0] = input;
    return OK;
}

static int readable(unit *it)
{
    return it->v.mode >= INITIALIZING &&
           !(fault == ORDER_ALLOWED && it->v.mode == ENDED);
}

#define GET(NAME, TYPE, FIELD, COUNT)                                                              \
    status NAME(void *c, const vref *r, size_t n, TYPE *v)                                         \
    {                                                                                              \
        unit *it = c;                                                                              \
        if (!is_there(it))                                                                          \
            return ERROR;                                                                          \
        if (fault == ZERO_LENGTH && !n)                                                            \
            return fail(it, "nothing to get");                                                     \
        if (!n)                                                                                    \
            return OK;                                                                             \
        if (!readable(it))                                                                         \
            return fail(it, #NAME " is not allowed now");                                          \
        if ((!r || !v) && fault != NULL_ARGUMENTS)                                                 \
            return fail(it, #NAME " with a null array");                                           \
        if (it->v.mode == INITIALIZING)                                                            \
            outputs(it);                                                                           \
        for (size_t i = 0; i < n; i++) {                                                           \
            if (r[i] >= COUNT) {                                                                   \
                if (fault == WRONG_REFERENCE)                                                      \
                    continue;                                                                      \
                return fail(it, #NAME " of an unknown variable");                                  \
            }                                                                                      \
            v[i] = it->v.FIELD[r[i]];                                                              \
        }                                                                                          \
        return OK;                                                                                 \
    }
GET(fmi2GetReal, double, real, REAL_COUNT)
GET(fmi2GetInteger, int, integer, INTEGER_COUNT)
GET(fmi2GetBoolean, int, boolean, BOOLEAN_COUNT)
GET(fmi2GetString, const char *, string, STRING_COUNT)

static int settable(unit *it, vref r)
{
    int early = it->v.mode <= INITIALIZING;
    switch (r) {
    case U: return it->v.mode <= STEPPING;
    case GAIN: return it->v.mode <= STEPPING;
    case X0: return early;
    case FIXED: return early || fault == FIXED_LATE;
    case CONSTANT: return fault == READ_ONLY;
    case Y: case Z: return fault == CALCULATED;
    default: return 0;
    }
}

#define SET_HEAD(NAME)                                                                             \
    unit *it = c;                                                                                  \
    if (!is_there(it))                                                                              \
        return ERROR;                                                                              \
    if (!n)                                                                                        \
        return OK;                                                                                 \
    if (!r || !v)                                                                                  \
        return fail(it, #NAME " with a null array");                                               \
    if (it->v.mode > STEPPING)                                                                     \
        return fail(it, #NAME " is not allowed now");

status fmi2SetReal(void *c, const vref *r, size_t n, const double *v)
{
    SET_HEAD(fmi2SetReal)
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= REAL_COUNT || !settable(it, r[i])) {
            if (r[i] >= REAL_COUNT && fault == WRONG_REFERENCE)
                continue;
            return fail(it, "fmi2SetReal of what cannot be set");
        }
        if (!isfinite(v[i])) {
            if (fault == INPUTS_EXTREME)
                abort();
            return fail(it, "fmi2SetReal with a value that is not finite");
        }
        it->v.real[r[i]] = fault == SET_THEN_GET ? (float)v[i] : v[i];
        if (r[i] == U)
            it->v.slope = 0;
    }
    return OK;
}
status fmi2SetInteger(void *c, const vref *r, size_t n, const int *v)
{
    SET_HEAD(fmi2SetInteger)
    for (size_t i = 0; i < n; i++) {
        if (r[i] != N)
            return fail(it, "fmi2SetInteger of what cannot be set");
        it->v.integer[N] = v[i];
    }
    return OK;
}
status fmi2SetBoolean(void *c, const vref *r, size_t n, const int *v)
{
    SET_HEAD(fmi2SetBoolean)
    for (size_t i = 0; i < n; i++) {
        if (r[i] != B)
            return fail(it, "fmi2SetBoolean of what cannot be set");
        it->v.boolean[B] = v[i];
    }
    return OK;
}
status fmi2SetString(void *c, const vref *r, size_t n, const char *const *v)
{
    SET_HEAD(fmi2SetString)
    for (size_t i = 0; i < n; i++) {
        if (r[i] != S || !v[i])
            return fail(it, "fmi2SetString of what cannot be set");
        memset(it->v.string[S], 0, sizeof it->v.string[S]);
        strncpy(it->v.string[S], v[i], sizeof it->v.string[S] - 1);
        if (fault == STRINGS)
            it->v.string[S][3] = (char)0xff;
    }
    return OK;
}

status fmi2GetFMUstate(void *c, void **s)
{
    unit *it = c;
    if (!is_there(it) || !s)
        return ERROR;
    if (fault == STATE_INDEPENDENT) {
        static values only;
        only = it->v;
        *s = &only;
        return OK;
    }
    if (!*s)
        *s = malloc(sizeof(values));
    else if (fault == STATE_MEMORY)
        return OK;
    *(values *)*s = it->v;
    if (fault == MEMORY_STATES)
        leak();
    return OK;
}
status fmi2SetFMUstate(void *c, void *s)
{
    unit *it = c;
    double slope, input, state;
    if (!is_there(it))
        return ERROR;
    if (!s)
        return fail(it, "fmi2SetFMUstate of null");
    slope = it->v.slope;
    input = it->v.real[U];
    state = it->v.state;
    it->v = *(values *)s;
    if (fault == STATE_INPUTS) {
        it->v.slope = slope;
        it->v.real[U] = input;
    }
    if (fault == STATE_RESTORED)
        it->v.state = state;
    return OK;
}
status fmi2FreeFMUstate(void *c, void **s)
{
    if (!is_there(c))
        return ERROR;
    if (!s || !*s || fault == STATE_INDEPENDENT)
        return OK;
    free(*s);
    *s = NULL;
    return OK;
}
static unsigned sum(const values *v)
{
    unsigned total = 17;
    for (size_t i = 0; i < sizeof *v; i++)
        total = total * 31 + ((const unsigned char *)v)[i];
    return total;
}
status fmi2SerializedFMUstateSize(void *c, void *s, size_t *n)
{
    if (!is_there(c) || !s || !n)
        return ERROR;
    *n = sizeof(values) + sizeof(unsigned);
    return OK;
}
status fmi2SerializeFMUstate(void *c, void *s, char *b, size_t n)
{
    unsigned check;
    values v;
    if (!is_there(c) || !s || !b || n < sizeof(values) + sizeof check)
        return ERROR;
    v = *(values *)s;
    if (fault == SERIALIZED)
        v.state = (float)v.state + 1e-3;
    if (fault == SERIALIZED_PROCESS)
        shared = v, v.real[GAIN] = 0;
    check = sum(&v);
    memcpy(b, &v, sizeof v);
    memcpy(b + sizeof v, &check, sizeof check);
    return OK;
}
status fmi2DeSerializeFMUstate(void *c, const char *b, size_t n, void **s)
{
    unsigned check;
    values v;
    unit *it = c;
    if (!is_there(it) || !s)
        return ERROR;
    memset(&v, 0, sizeof v);
    if (fault == SERIALIZED_DAMAGED && n < sizeof v) {
        *s = calloc(1, sizeof v);
        return OK;
    }
    if (!b || n != sizeof v + sizeof check)
        return fail(it, "these bytes are no state");
    memcpy(&v, b, sizeof v);
    memcpy(&check, b + sizeof v, sizeof check);
    if (check != sum(&v))
        return fail(it, "the bytes of the state are damaged");
    if (fault == SERIALIZED_PROCESS && shared.mode)
        v = shared;
    *s = malloc(sizeof v);
    *(values *)*s = v;
    return OK;
}

status fmi2GetDirectionalDerivative(void *c, const vref *z, size_t nz, const vref *k, size_t nk,
                                    const double *dk, double *dz)
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (it->v.mode < INITIALIZING)
        return fail(it, "fmi2GetDirectionalDerivative is not allowed now");
    for (size_t i = 0; i < nz; i++) {
        dz[i] = 0;
        for (size_t j = 0; j < nk; j++) {
            if (z[i] >= REAL_COUNT || k[j] >= REAL_COUNT)
                return fail(it, "fmi2GetDirectionalDerivative of an unknown variable");
            if (z[i] == Z && k[j] == U)
                dz[i] += dk[j] * it->v.real[GAIN] * (fault == DIRECTIONAL ? -1 : 1);
        }
    }
    return OK;
}

status fmi2SetRealInputDerivatives(void *c, const vref *r, size_t n, const int *order,
                                   const double *v)
{
    SET_HEAD(fmi2SetRealInputDerivatives)
    for (size_t i = 0; i < n; i++) {
        if (fault == INPUT_DERIVATIVES_WRONG && r[i] == U && order[i] != 1)
            continue;
        if (r[i] != U || order[i] != 1 || !isfinite(v[i]))
            return fail(it, "only the first derivative of u is known");
        if (fault != INPUT_DERIVATIVES)
            it->v.slope = v[i];
    }
    return OK;
}
status fmi2GetRealOutputDerivatives(void *c, const vref *r, size_t n, const int *order, double *v)
{
    unit *it = c;
    if (!is_there(it))
        return ERROR;
    if (it->v.mode < STEPPING)
        return fail(it, "fmi2GetRealOutputDerivatives is not allowed now");
    for (size_t i = 0; i < n; i++) {
        if ((r[i] != Y && r[i] != Z) || order[i] != 1)
            return fail(it, "only first derivatives of y and z are known");
        v[i] = it->v.real[U] - it->v.state;
        if (fault == OUTPUT_DERIVATIVES)
            v[i] *= 10;
    }
    return OK;
}

/* fourth order Runge-Kutta in steps of at most 0.1 ms */
static void integrate(values *v, double h)
{
    int count = (int)ceil(h / 1e-4);
    double d, u;
    if (count < 1 || fault == STEP_SPLIT)
        count = 1;
    d = h / count;
    u = v->real[U];
    for (int i = 0; i < count; i++) {
        double s = v->slope, x = v->state;
        double k1 = u - x, k2 = u + s * d / 2 - (x + d / 2 * k1);
        double k3 = u + s * d / 2 - (x + d / 2 * k2), k4 = u + s * d - (x + d * k3);
        v->state = fault == STEP_SPLIT ? x + sqrt(d) * k1 * 0.1
                                       : x + d / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        u += s * d;
    }
    v->real[U] = u;
    v->slope = 0;
}

status fmi2DoStep(void *c, double t, double h, int no)
{
    unit *it = c;
    values *v;
    if (!is_there(it))
        return ERROR;
    v = &it->v;
    if (v->mode != STEPPING)
        return fail(it, "fmi2DoStep is not allowed now");
    if (fault == AFTER_ERROR && !(h > 0)) {
        shared.mode = BROKEN;
    } else if (!(h > 0) || !isfinite(h)) {
        if (!(fault == STEP_INVALID && h == 0) && !(fault == STEP_NOT_FINITE && isinf(h)))
            return fail(it, "fmi2DoStep with a size that is not above 0");
    }
    if (fault == AFTER_ERROR && shared.mode == BROKEN)
        return fail(it, "an instance has failed");
    if (fabs(t - v->now) > (fault == STEP_ROUNDED ? 0 : 1e-6 * h + 1e-12) && fault != STEP_ELSEWHERE)
        return fail(it, "fmi2DoStep not where the last step ended");
    if (v->stop_defined && t + h > v->stop + 1e-9 && fault != STEP_PAST_STOP)
        return fail(it, "fmi2DoStep past the stop time");
    if (fault == STEP_VARYING && it->steps > 0 && fabs(h - 1e-2) > 1e-12)
        return fail(it, "fmi2DoStep with another size");
    if (fault == STEP_EXTREME && h < 1e-9)
        for (;;)
            usleep(1000);
    if (fault == CRASH && it->steps == 2)
        *(volatile int *)8 = 1;
    if (fault == HANG && it->steps == 2)
        for (;;)
            usleep(1000);
    if (fault == EXIT && it->steps == 2)
        exit(0);
    if (fault == SILENT)
        printf("step at %g\n", t);
    if (fault == MEMORY_STEPS)
        leak();
    if (fault == MANY_INSTANCES) {
        shared.state = it->steps ? shared.state : v->state;
        v->state = shared.state;
    }
    if (fault == THREADS) {
        static pthread_t first;
        if (!first)
            first = pthread_self();
        if (first != pthread_self())
            v->state += 1e-9;
    }
    integrate(v, h);
    if (fault == MANY_INSTANCES)
        shared.state = v->state;
    it->steps++;
    v->now = fault == STEP_ROUNDED ? it->steps * h : t + h;
    outputs(it);
    return fault == RUN ? DISCARD : OK;
}
status fmi2CancelStep(void *c)
{
    return is_there(c) ? fail(c, "fmi2CancelStep: no step is pending") : ERROR;
}
static status none(unit *it)
{
    if (!is_there(it))
        return ERROR;
    return fault == STATUS_KINDS ? ERROR : DISCARD;
}
status fmi2GetStatus(void *c, int kind, status *v) { return none(c); }
status fmi2GetRealStatus(void *c, int kind, double *v)
{
    unit *it = c;
    if (kind != 2 || it->v.mode < STEPPING)
        return none(c);
    *v = it->v.now;
    return OK;
}
status fmi2GetIntegerStatus(void *c, int kind, int *v) { return none(c); }
status fmi2GetBooleanStatus(void *c, int kind, int *v) { return none(c); }
status fmi2GetStringStatus(void *c, int kind, const char **v) { return none(c); }
