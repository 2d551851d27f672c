/* Receives a unit's log messages. The callbacks are variadic, which Rust cannot define: these
 * format the text and hand it on. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Functions of logger/mod.rs and of the harness of fmi2-conformance. They are set before the first
 * use. By name they would be exported by a library that contains a master, such as a bundle. */
static void (*master_sink)(void *environment, const char *instance, int status,
                           const char *category, const char *message);
static void (*conformance_sink)(void *environment, const char *instance, int status,
                                const char *category, const char *format, const char *message);

void master_log_to(void (*sink)(void *, const char *, int, const char *, const char *))
{
    master_sink = sink;
}

void conformance_log_to(void (*sink)(void *, const char *, int, const char *, const char *,
                                     const char *))
{
    conformance_sink = sink;
}

/* The text, in `fixed` where it fits, else in memory to be freed; the format itself where it
 * cannot be used. */
static char *formatted(char *fixed, size_t size, const char *format, va_list arguments)
{
    char *text = fixed;
    va_list again;
    int length;

    va_copy(again, arguments);
    length = vsnprintf(fixed, size, format, arguments);
    if (length < 0) {
        text = (char *)format;
    } else if ((size_t)length >= size) {
        char *longer = malloc((size_t)length + 1);
        if (longer) {
            vsnprintf(longer, (size_t)length + 1, format, again);
            text = longer;
        }
    }
    va_end(again);
    return text;
}

void master_log(void *environment, const char *instance, int status, const char *category,
                const char *format, ...)
{
    char fixed[2048];
    char *text = NULL;
    va_list arguments;

    if (format) {
        va_start(arguments, format);
        text = formatted(fixed, sizeof fixed, format, arguments);
        va_end(arguments);
    }
    master_sink(environment, instance, status, category, text);
    if (text != fixed && text != format)
        free(text);
}

/* As master_log, but a format with %n, which writes to memory, is handed on unused. */
void conformance_log(void *environment, const char *instance, int status, const char *category,
                     const char *format, ...)
{
    char fixed[2048];
    char *text = (char *)format;
    va_list arguments;

    if (format && !strstr(format, "%n")) {
        va_start(arguments, format);
        text = formatted(fixed, sizeof fixed, format, arguments);
        va_end(arguments);
    }
    conformance_sink(environment, instance, status, category, format, text);
    if (text != fixed && text != format)
        free(text);
}
