/* Drives a unit in real time, in plain C: steps at their times by the clock, and reports overruns.
 *
 *     unzip -d train target/fmu/train.fmu
 *     cc -O2 -I HEADERS real_time.c -ldl -o real_time && ./real_time train vehicle_gap_01 10 0.005
 *
 * Arguments: the folder of the unpacked unit, an output to watch, the time to simulate (s), the step (s), and whether to
 * wait for the clock (1, the default) or to run as fast as possible (0). HEADERS is a folder with the three headers of the
 * FMI 2.0 standard; the Python package fmpy has them in fmpy/c-code. Works with any FMI 2.0 co-simulation unit.
 *
 * A step that is not finished when the next one is due is an overrun. The exit status is 1 if there was one. Other programs
 * cause overruns too, unless this one goes first: `sudo chrt -f 50 ./real_time ...` */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2FunctionTypes.h"

static void *library;

static void fail(const char *what, const char *why) {
    fprintf(stderr, "%s: %s\n", what, why);
    exit(2);
}

static void *function(const char *name) {
    void *found = dlsym(library, name);
    if (!found) fail(name, dlerror());
    return found;
}

static void say(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                fmi2String message, ...) {
    va_list rest;
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s: ", instance);
    va_start(rest, message);
    vfprintf(stderr, message, rest);
    va_end(rest);
    fputc('\n', stderr);
}

static void check(fmi2Status status, const char *call) {
    if (status > fmi2Warning) fail(call, "failed");
}

/* The description of the unit. */
static char *description(const char *folder) {
    char path[4096];
    snprintf(path, sizeof path, "%s/modelDescription.xml", folder);
    FILE *file = fopen(path, "rb");
    if (!file) { perror(path); exit(2); }
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    rewind(file);
    char *text = calloc((size_t)size + 1, 1);
    if (!text || fread(text, 1, (size_t)size, file) != (size_t)size) fail(path, "cannot be read");
    fclose(file);
    return text;
}

/* An attribute's value, the first after `from`. */
static char *attribute(const char *from, const char *name) {
    char *start = from ? strstr(from, name) : NULL;
    char *end = start ? strchr(start + strlen(name), '"') : NULL;
    if (!end) fail(name, "is not in modelDescription.xml");
    start += strlen(name);
    return strndup(start, (size_t)(end - start));
}

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void wait_until(double moment) {
    struct timespec time = {(time_t)moment, (long)(1e9 * (moment - (double)(time_t)moment))};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, NULL)) {}
}

int main(int count, char **arguments) {
    if (count < 5) fail("usage", "real_time FOLDER OUTPUT SECONDS STEP [WAIT]");
    char *whole = realpath(arguments[1], NULL), path[4200], resources[4200], wanted[256];
    if (!whole) { perror(arguments[1]); return 2; }
    const double span = atof(arguments[3]), size = atof(arguments[4]);
    const int waits = count < 6 || atoi(arguments[5]);
    const long steps = (long)(span / size + 0.5);
    char *text = description(whole);
    char *guid = attribute(text, " guid=\""), *identifier = attribute(text, " modelIdentifier=\"");
    snprintf(wanted, sizeof wanted, "<ScalarVariable name=\"%s\"", arguments[2]);
    const fmi2ValueReference output = (unsigned)atol(attribute(strstr(text, wanted), " valueReference=\""));
    snprintf(path, sizeof path, "%s/binaries/linux64/%s.so", whole, identifier);
    snprintf(resources, sizeof resources, "file://%s/resources", whole);
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(path, dlerror());

    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)function("fmi2Instantiate");
    fmi2SetupExperimentTYPE *setup = (fmi2SetupExperimentTYPE *)function("fmi2SetupExperiment");
    fmi2EnterInitializationModeTYPE *enter = (fmi2EnterInitializationModeTYPE *)function("fmi2EnterInitializationMode");
    fmi2ExitInitializationModeTYPE *leave = (fmi2ExitInitializationModeTYPE *)function("fmi2ExitInitializationMode");
    fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)function("fmi2GetReal");
    fmi2DoStepTYPE *step = (fmi2DoStepTYPE *)function("fmi2DoStep");
    fmi2TerminateTYPE *terminate = (fmi2TerminateTYPE *)function("fmi2Terminate");
    fmi2FreeInstanceTYPE *release = (fmi2FreeInstanceTYPE *)function("fmi2FreeInstance");

    const fmi2CallbackFunctions callbacks = {say, calloc, free, NULL, NULL};
    fmi2Component unit = instantiate("unit", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2False);
    if (!unit) return 2;
    check(setup(unit, fmi2False, 0.0, 0.0, fmi2True, (double)steps * size), "fmi2SetupExperiment");
    check(enter(unit), "fmi2EnterInitializationMode");
    check(leave(unit), "fmi2ExitInitializationMode");

    long overruns = 0;
    double longest = 0.0, busy = 0.0, latency = 0.0, value = 0.0;
    const double begin = now();
    for (long n = 0; n < steps; n++) {
        const double before = now();
        check(step(unit, (double)n * size, size, fmi2True), "fmi2DoStep");
        check(get(unit, &output, 1, &value), "fmi2GetReal");
        /* here a program would read its sensors and set inputs */
        const double took = now() - before, due = begin + (double)(n + 1) * size;
        busy += took;
        if (took > longest) longest = took;
        if (now() > due) overruns += waits;
        else if (waits) {
            wait_until(due);
            const double late = now() - due;
            if (late > latency) latency = late;
        }
    }
    check(terminate(unit), "fmi2Terminate");
    release(unit);
    printf("%s = %.9g at %g s\n", arguments[2], value, (double)steps * size);
    printf("%ld steps of %g ms: %.2f ms on average, %.2f ms the longest, %.0f %% of real time, %ld overruns", steps,
           1e3 * size, 1e3 * busy / (double)steps, 1e3 * longest, 100.0 * busy / span, overruns);
    if (waits) printf(", woken at most %.2f ms late", 1e3 * latency);
    putchar('\n');
    free(text), free(guid), free(identifier), free(whole);
    return overruns > 0;
}
