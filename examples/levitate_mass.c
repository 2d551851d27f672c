/* Levitates a mass of its own with the `ems` unit, in plain C: what an importer does, call by call.
 *
 *     unzip -d ems target/fmu/ems.fmu
 *     cc -I HEADERS levitate_mass.c -ldl -lm -o levitate_mass && ./levitate_mass ems
 *
 * HEADERS is a folder with the three headers of the FMI 2.0 standard; the Python package fmpy carries them in fmpy/c-code.
 * The mass hangs half a millimetre too low; the magnet pulls it up to the nominal gap of 8 mm. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

/* Value references and GUID, from modelDescription.xml; a program for any unit would read them there. */
enum { GAP = 0, GAP_RATE = 1, ACCELERATION = 2, STATIC_FORCE = 4, FORCE = 5 };

static const double MASS = 250.0, GRAVITY = 9.81, STEP = 1e-4;
static const int STEPS = 25000;

static void *unit;

static void *function(const char *name) {
    void *found = dlsym(unit, name);
    if (!found) { fprintf(stderr, "%s\n", dlerror()); exit(1); }
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
    if (status != fmi2OK) { fprintf(stderr, "%s returned %d\n", call, status); exit(1); }
}

/* The GUID of an unpacked unit, out of its description. */
static const char *guid(const char *folder) {
    static char text[4096];
    char path[4096];
    snprintf(path, sizeof path, "%s/modelDescription.xml", folder);
    FILE *file = fopen(path, "rb");
    if (!file) { perror(path); exit(1); }
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    char *start = strstr(text, "guid=\"");
    char *end = start ? strchr(start + 6, '"') : NULL;
    if (!end) { fprintf(stderr, "%s has no GUID\n", path); exit(1); }
    *end = '\0';
    return start + 6;
}

int main(int count, char **arguments) {
    const char *folder = count > 1 ? arguments[1] : "ems";
    char *whole = realpath(folder, NULL), path[4096], resources[4096];
    if (!whole) { perror(folder); return 1; }
    snprintf(path, sizeof path, "%s/binaries/linux64/ems.so", whole);
    snprintf(resources, sizeof resources, "file://%s/resources", whole);
    unit = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!unit) { fprintf(stderr, "%s\n", dlerror()); return 1; }

    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)function("fmi2Instantiate");
    fmi2SetupExperimentTYPE *setup = (fmi2SetupExperimentTYPE *)function("fmi2SetupExperiment");
    fmi2EnterInitializationModeTYPE *enter = (fmi2EnterInitializationModeTYPE *)function("fmi2EnterInitializationMode");
    fmi2ExitInitializationModeTYPE *leave = (fmi2ExitInitializationModeTYPE *)function("fmi2ExitInitializationMode");
    fmi2SetRealTYPE *set = (fmi2SetRealTYPE *)function("fmi2SetReal");
    fmi2GetRealTYPE *get = (fmi2GetRealTYPE *)function("fmi2GetReal");
    fmi2DoStepTYPE *step = (fmi2DoStepTYPE *)function("fmi2DoStep");
    fmi2TerminateTYPE *terminate = (fmi2TerminateTYPE *)function("fmi2Terminate");
    fmi2FreeInstanceTYPE *release = (fmi2FreeInstanceTYPE *)function("fmi2FreeInstance");

    const fmi2CallbackFunctions callbacks = {say, calloc, free, NULL, NULL};
    fmi2Component magnet =
        instantiate("magnet", fmi2CoSimulation, guid(whole), resources, &callbacks, fmi2False, fmi2False);
    if (!magnet) return 1;
    check(setup(magnet, fmi2False, 0.0, 0.0, fmi2False, 0.0), "fmi2SetupExperiment");
    check(enter(magnet), "fmi2EnterInitializationMode");
    const fmi2ValueReference inputs[] = {GAP, GAP_RATE, ACCELERATION, STATIC_FORCE}, output[] = {FORCE};
    /* gap, its rate, acceleration (downward is positive, as it opens the gap), the load that it carries */
    fmi2Real state[] = {0.0085, 0.0, 0.0, MASS * GRAVITY}, force;
    check(set(magnet, inputs, 4, state), "fmi2SetReal");
    check(leave(magnet), "fmi2ExitInitializationMode");

    for (int n = 0; n < STEPS; n++) {
        check(step(magnet, n * STEP, STEP, fmi2True), "fmi2DoStep");
        check(get(magnet, output, 1, &force), "fmi2GetReal");
        state[2] = GRAVITY - force / MASS;
        state[1] += STEP * state[2];
        state[0] += STEP * state[1];
        check(set(magnet, inputs, 3, state), "fmi2SetReal");
    }
    check(terminate(magnet), "fmi2Terminate");
    release(magnet);
    free(whole);
    printf("settled gap: %.3f mm\n", 1e3 * state[0]);
    return fabs(state[0] - 0.008) > 1e-5;
}
