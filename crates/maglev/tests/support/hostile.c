/* unit.c with every function in a wrapper that does mischief on demand. The environment says which:
 *   HOSTILE="instance function mischief time"
 * from that simulated time on (the unit's own; before stepping it is the start time). Mischief is a
 * status by its number, or a word of `words` below. HOSTILE_LOG names a file for the calls that end an
 * instance. After a status 4 (fmi2Fatal), any call into this library aborts. */
#define _GNU_SOURCE
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define fmi2Instantiate honest_fmi2Instantiate
#define fmi2FreeInstance honest_fmi2FreeInstance
#define fmi2SetupExperiment honest_fmi2SetupExperiment
#define fmi2EnterInitializationMode honest_fmi2EnterInitializationMode
#define fmi2ExitInitializationMode honest_fmi2ExitInitializationMode
#define fmi2Terminate honest_fmi2Terminate
#define fmi2Reset honest_fmi2Reset
#define fmi2GetReal honest_fmi2GetReal
#define fmi2GetInteger honest_fmi2GetInteger
#define fmi2GetBoolean honest_fmi2GetBoolean
#define fmi2GetString honest_fmi2GetString
#define fmi2SetReal honest_fmi2SetReal
#define fmi2SetInteger honest_fmi2SetInteger
#define fmi2SetBoolean honest_fmi2SetBoolean
#define fmi2SetString honest_fmi2SetString
#define fmi2GetFMUstate honest_fmi2GetFMUstate
#define fmi2SetFMUstate honest_fmi2SetFMUstate
#define fmi2FreeFMUstate honest_fmi2FreeFMUstate
#define fmi2SerializedFMUstateSize honest_fmi2SerializedFMUstateSize
#define fmi2SerializeFMUstate honest_fmi2SerializeFMUstate
#define fmi2DeSerializeFMUstate honest_fmi2DeSerializeFMUstate
#define fmi2GetDirectionalDerivative honest_fmi2GetDirectionalDerivative
#define fmi2SetRealInputDerivatives honest_fmi2SetRealInputDerivatives
#define fmi2GetRealOutputDerivatives honest_fmi2GetRealOutputDerivatives
#define fmi2DoStep honest_fmi2DoStep
#define fmi2CancelStep honest_fmi2CancelStep
#define fmi2GetStatus honest_fmi2GetStatus
#define fmi2GetRealStatus honest_fmi2GetRealStatus
#define fmi2GetIntegerStatus honest_fmi2GetIntegerStatus
#define fmi2GetBooleanStatus honest_fmi2GetBooleanStatus
#define fmi2GetStringStatus honest_fmi2GetStringStatus
#include "unit.c"
#undef fmi2Instantiate
#undef fmi2FreeInstance
#undef fmi2SetupExperiment
#undef fmi2EnterInitializationMode
#undef fmi2ExitInitializationMode
#undef fmi2Terminate
#undef fmi2Reset
#undef fmi2GetReal
#undef fmi2GetInteger
#undef fmi2GetBoolean
#undef fmi2GetString
#undef fmi2SetReal
#undef fmi2SetInteger
#undef fmi2SetBoolean
#undef fmi2SetString
#undef fmi2GetFMUstate
#undef fmi2SetFMUstate
#undef fmi2FreeFMUstate
#undef fmi2SerializedFMUstateSize
#undef fmi2SerializeFMUstate
#undef fmi2DeSerializeFMUstate
#undef fmi2GetDirectionalDerivative
#undef fmi2SetRealInputDerivatives
#undef fmi2GetRealOutputDerivatives
#undef fmi2DoStep
#undef fmi2CancelStep
#undef fmi2GetStatus
#undef fmi2GetRealStatus
#undef fmi2GetIntegerStatus
#undef fmi2GetBooleanStatus
#undef fmi2GetStringStatus

enum { HONEST = 1000, NOT_A_NUMBER, INFINITE, ENDED, STUCK, COARSE };
static int broken; /* after fmi2Fatal */

#ifdef EXIT_WHILE_LOADING
__attribute__((constructor)) static void quit(void)
{
    exit(0);
}
#endif
#ifdef CRASH_AT_EXIT
static void count(void);
__attribute__((destructor)) static void crash(void)
{
    count();
    *(volatile int *)NULL = 1;
}
#endif

/* one byte in the log for each step */
static void count(void)
{
    FILE *file = fopen(getenv("HOSTILE_LOG"), "a");
    fputc('.', file);
    fclose(file);
}

/* a child that ends well is nobody's business */
static void fork_a_child(void (*end)(int))
{
    int status = -1;
    pid_t child = fork();
    if (child == 0)
        end(0);
    waitpid(child, &status, 0);
    if (status != 0)
        abort();
}

/* writes rubbish over the memory that an isolated unit shares with its master */
static void trample(void)
{
    char line[512];
    FILE *maps = fopen("/proc/self/maps", "r");
    while (maps && fgets(line, sizeof line, maps)) {
        unsigned long from, to;
        if (strstr(line, "isolated-unit") && sscanf(line, "%lx-%lx", &from, &to) == 2)
            memset((void *)from, 0xa5, to - from);
    }
    abort();
}

static int misbehave(const char *word)
{
    if (!strcmp(word, "null"))
        *(volatile int *)NULL = 1;
    if (!strcmp(word, "wild"))
        *(volatile int *)(uintptr_t)0x123456789abcdef8u = 1;
    if (!strcmp(word, "abort"))
        abort();
    if (!strcmp(word, "exit"))
        exit(3);
    if (!strcmp(word, "quit")) /* as if all were well */
        exit(0);
    if (!strcmp(word, "quit-now"))
        _exit(0);
    if (!strcmp(word, "quit-C99"))
        _Exit(0);
    if (!strcmp(word, "quit-fast"))
        quick_exit(0);
    if (!strcmp(word, "children")) {
        fork_a_child(exit);
        fork_a_child(_exit);
        return HONEST;
    }
    if (!strcmp(word, "slow")) {
        count();
        usleep(50000);
        return HONEST;
    }
    if (!strcmp(word, "hang"))
        for (;;)
            pause();
    if (!strcmp(word, "loop"))
        for (volatile int k = 0;; k++)
            ;
    if (!strcmp(word, "chdir"))
        return chdir("/") ? ERROR : HONEST;
    if (!strcmp(word, "trample"))
        trample();
    if (!strcmp(word, "hoard")) { /* 64 GB */
        void *memory = malloc((size_t)1 << 36);
        free(memory);
        return memory ? HONEST : ERROR;
    }
    if (!strcmp(word, "nan"))
        return NOT_A_NUMBER;
    if (!strcmp(word, "inf"))
        return INFINITE;
    if (!strcmp(word, "ended")) /* a discarded step that asks to end */
        return ENDED;
    if (!strcmp(word, "stuck")) /* pending for ever */
        return STUCK;
    if (!strcmp(word, "coarse")) /* steps above 0.03 s are discarded */
        return COARSE;
    return atoi(word);
}

static int wanted(const char *instance, const char *function, double now)
{
    char name[64], call[64], word[16];
    double from;
    const char *order = getenv("HOSTILE");
    if (broken)
        abort();
    if (!order || sscanf(order, "%63s %63s %15s %lf", name, call, word, &from) != 4)
        return HONEST;
    if (strcmp(name, instance) || strcmp(call, function) || now < from - 1e-9)
        return HONEST;
    int what = misbehave(word);
    broken = what == FATAL;
    return what;
}

static int trap(component c, const char *function)
{
    unit *it = c;
    int what = wanted(it->name, function, it->time);
    if (what == ERROR)
        say(it, ERROR, "the model broke");
    return what;
}

static void enter_log(component c, const char *function)
{
    const char *name = getenv("HOSTILE_LOG");
    FILE *file = name ? fopen(name, "a") : NULL;
    if (file) {
        fprintf(file, "%s %s\n", ((unit *)c)->name, function);
        fclose(file);
    }
}

component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                          const callbacks *call, int visible, int logging)
{
    if (wanted(name, "fmi2Instantiate", -1e300) != HONEST)
        return NULL;
    return honest_fmi2Instantiate(name, type, guid, resources, call, visible, logging);
}
void fmi2FreeInstance(component c)
{
    enter_log(c, "fmi2FreeInstance");
    trap(c, "fmi2FreeInstance");
    honest_fmi2FreeInstance(c);
}

/* status warning and pending come after the call has been done, others instead of it */
#define WRAP(name, parameters, arguments)                                                          \
    status name parameters                                                                         \
    {                                                                                              \
        int what = trap(c, #name);                                                                 \
        if (what < HONEST && what != OK && what != WARNING && what != PENDING)                     \
            return what;                                                                           \
        status answer = honest_##name arguments;                                                   \
        return answer == OK && what < HONEST ? what : answer;                                      \
    }

WRAP(fmi2SetupExperiment, (component c, int t, double tol, double a, int s, double b),
     (c, t, tol, a, s, b))
WRAP(fmi2EnterInitializationMode, (component c), (c))
WRAP(fmi2ExitInitializationMode, (component c), (c))
WRAP(fmi2Reset, (component c), (c))
WRAP(fmi2GetInteger, (component c, const vref *r, size_t n, int *v), (c, r, n, v))
WRAP(fmi2GetBoolean, (component c, const vref *r, size_t n, int *v), (c, r, n, v))
WRAP(fmi2GetString, (component c, const vref *r, size_t n, const char **v), (c, r, n, v))
WRAP(fmi2SetReal, (component c, const vref *r, size_t n, const double *v), (c, r, n, v))
WRAP(fmi2SetInteger, (component c, const vref *r, size_t n, const int *v), (c, r, n, v))
WRAP(fmi2SetBoolean, (component c, const vref *r, size_t n, const int *v), (c, r, n, v))
WRAP(fmi2SetString, (component c, const vref *r, size_t n, const char *const *v), (c, r, n, v))
WRAP(fmi2GetFMUstate, (component c, void **s), (c, s))
WRAP(fmi2SetFMUstate, (component c, void *s), (c, s))
WRAP(fmi2FreeFMUstate, (component c, void **s), (c, s))
WRAP(fmi2SerializedFMUstateSize, (component c, void *s, size_t *n), (c, s, n))
WRAP(fmi2SerializeFMUstate, (component c, void *s, char *b, size_t n), (c, s, b, n))
WRAP(fmi2DeSerializeFMUstate, (component c, const char *b, size_t n, void **s), (c, b, n, s))
WRAP(fmi2GetDirectionalDerivative,
     (component c, const vref *u, size_t nu, const vref *k, size_t nk, const double *dk, double *du),
     (c, u, nu, k, nk, dk, du))
WRAP(fmi2SetRealInputDerivatives,
     (component c, const vref *r, size_t n, const int *o, const double *v), (c, r, n, o, v))
WRAP(fmi2CancelStep, (component c), (c))
WRAP(fmi2GetRealStatus, (component c, int k, double *v), (c, k, v))
WRAP(fmi2GetIntegerStatus, (component c, int k, int *v), (c, k, v))
WRAP(fmi2GetStringStatus, (component c, int k, const char **v), (c, k, v))

status fmi2Terminate(component c)
{
    enter_log(c, "fmi2Terminate");
    int what = trap(c, "fmi2Terminate");
    return what < HONEST ? what : honest_fmi2Terminate(c);
}

static status spoil(int what, double *v, size_t n, status answer)
{
    for (size_t i = 0; i < n && (what == NOT_A_NUMBER || what == INFINITE); i++)
        v[i] = what == INFINITE ? -INFINITY : NAN;
    return answer == OK && what < HONEST ? what : answer;
}
status fmi2GetReal(component c, const vref *r, size_t n, double *v)
{
    int what = trap(c, "fmi2GetReal");
    return spoil(what, v, n, honest_fmi2GetReal(c, r, n, v));
}
status fmi2GetRealOutputDerivatives(component c, const vref *r, size_t n, const int *o, double *v)
{
    int what = trap(c, "fmi2GetRealOutputDerivatives");
    return spoil(what, v, n, honest_fmi2GetRealOutputDerivatives(c, r, n, o, v));
}
status fmi2DoStep(component c, double t, double h, int no)
{
    int what = trap(c, "fmi2DoStep");
    if (what == ENDED || (what == COARSE && h > 0.03))
        return DISCARD;
    if (what < HONEST && what != OK && what != WARNING && what != PENDING)
        return what;
    status answer = honest_fmi2DoStep(c, t, h, no);
    ((unit *)c)->pending = what == STUCK ? 1 << 30 : 3;
    if (what == STUCK)
        return PENDING;
    return answer == OK && what < HONEST ? what : answer;
}
status fmi2GetStatus(component c, int kind, status *v)
{
    int what = trap(c, "fmi2GetStatus");
    status answer = honest_fmi2GetStatus(c, kind, v);
    return what < HONEST ? what : answer;
}
status fmi2GetBooleanStatus(component c, int kind, int *v)
{
    const char *order = getenv("HOSTILE");
    *v = kind == 3 && order && strstr(order, " ended ");
    int what = trap(c, "fmi2GetBooleanStatus");
    return what < HONEST ? what : OK;
}
