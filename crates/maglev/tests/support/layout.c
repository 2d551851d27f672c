/* A unit for tests that prints its own description, as those made with fmi2-export do. Its resource layout.json is
 * {"title": ..., "items": [{"name": ..., "gain": ...}]}; the start value of its parameter gain is the sum of all gains.
 * An item with a gain below 0 is refused. */
#include <stdio.h>

#define fmi2Instantiate instantiate_plain
#include "unit.c"
#undef fmi2Instantiate

/* The sum of the gains in the layout, or a negative number with the reason. */
static double layout(const char *folder, char *reason, size_t capacity)
{
    static char path[4096], text[65536];
    double sum = 0;
    snprintf(path, sizeof path, "%s/layout.json", folder);
    FILE *file = fopen(path, "r");
    if (!file) {
        snprintf(reason, capacity, "resource layout.json: cannot be read");
        return -1;
    }
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    int item = 0;
    for (char *at = text; (at = strstr(at, "\"gain\":")); item++) {
        double gain = strtod(at += strlen("\"gain\":"), NULL);
        if (gain < 0) {
            snprintf(reason, capacity, "resource layout.json: at items[%d].gain: it is negative", item);
            return -1;
        }
        sum += gain;
    }
    return sum;
}

static void guid(double gain, char *text, size_t capacity)
{
    snprintf(text, capacity, "layout-%.17g", gain);
}

size_t fmi2_export_describe(const char *folder, char *buffer, size_t capacity)
{
    char its[64];
    double gain = layout(folder, buffer, capacity);
    if (gain < 0)
        return 0;
    guid(gain, its, sizeof its);
    return snprintf(buffer, capacity,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"layout %g\" guid=\"%s\" "
        "generationTool=\"fmi2-export test\">\n"
        "  <CoSimulation modelIdentifier=\"unit\" canGetAndSetFMUstate=\"true\" "
        "canSerializeFMUstate=\"true\"/>\n"
        "  <DefaultExperiment startTime=\"0\" stopTime=\"%g\" stepSize=\"0.5\"/>\n"
        "  <ModelVariables>\n"
        "    <ScalarVariable name=\"u\" valueReference=\"0\" causality=\"input\"><Real start=\"0\"/></ScalarVariable>\n"
        "    <ScalarVariable name=\"z\" valueReference=\"2\" causality=\"output\"><Real/></ScalarVariable>\n"
        "    <ScalarVariable name=\"gain\" valueReference=\"4\" causality=\"parameter\" variability=\"tunable\">"
        "<Real start=\"%g\"/></ScalarVariable>\n"
        "  </ModelVariables>\n"
        "  <ModelStructure><Outputs><Unknown index=\"2\" dependencies=\"1\"/></Outputs>"
        "<InitialUnknowns><Unknown index=\"2\" dependencies=\"1 3\"/></InitialUnknowns></ModelStructure>\n"
        "</fmiModelDescription>\n",
        gain, its, gain, gain);
}

component fmi2Instantiate(const char *name, int type, const char *given, const char *resources,
                          const callbacks *call, int visible, int logging)
{
    char its[256];
    double gain = layout(resources + strlen("file://"), its, sizeof its);
    if (gain >= 0)
        guid(gain, its, sizeof its);
    if (gain < 0 || strcmp(given, its)) {
        call->log(call->environment, name, ERROR, NULL, "GUID %s does not fit: %s", given, its);
        return NULL;
    }
    unit *it = instantiate_plain(name, type, GUID, resources, call, visible, logging);
    if (it)
        it->real[GAIN] = gain;
    return it;
}
