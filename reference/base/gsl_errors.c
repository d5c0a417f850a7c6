#include "gsl_errors.h"

#include <gsl/gsl_errno.h>
#include <stdio.h>
#include <stdlib.h>

static void on_error(const char *reason, const char *file, int line, int code)
{
    if (code == GSL_ENOMEM)
        return;
    fprintf(stderr, "gsl: %s:%d: %s\n", file, line, reason);
    abort();
}

void gsl_errors_of_memory_return(void)
{
    gsl_set_error_handler(on_error);
}
