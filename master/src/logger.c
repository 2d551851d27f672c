/* Receives a unit's log messages. The callback is variadic, which Rust cannot define: this
 * formats the text and hands it on. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* defined in logger.rs */
extern void master_log_sink(void *environment, const char *instance, int status,
                            const char *category, const char *message);

void master_log(void *environment, const char *instance, int status, const char *category,
                const char *format, ...)
{
    char fixed[2048];
    char *text = fixed;
    va_list arguments;
    int length;

    if (!format) {
        master_log_sink(environment, instance, status, category, NULL);
        return;
    }
    va_start(arguments, format);
    length = vsnprintf(fixed, sizeof fixed, format, arguments);
    va_end(arguments);
    if (length >= (int)sizeof fixed) {
        char *longer = malloc((size_t)length + 1);
        if (longer) {
            va_start(arguments, format);
            vsnprintf(longer, (size_t)length + 1, format, arguments);
            va_end(arguments);
            text = longer;
        }
    }
    /* a negative length says that the format cannot be used: pass it on as it is */
    master_log_sink(environment, instance, status, category, length < 0 ? format : text);
    if (text != fixed)
        free(text);
}
