/* The types of FMI 2.0, under short names for the units of the tests. */
#include <stddef.h>

typedef void *component;
typedef unsigned int vref;
typedef int status;
enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING };
typedef void (*logger)(void *, const char *, status, const char *, const char *, ...);
typedef struct {
    logger log;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, status);
    void *environment;
} callbacks;
