/* Error handling of the GNU Scientific Library (GSL). */
#ifndef ASSAY_GSL_ERRORS_H
#define ASSAY_GSL_ERRORS_H

/* By default GSL aborts on every error. After this call, in the whole process, its functions return NULL when memory
 * runs out, which all callers here check; any other error is a bug of ours and still aborts, with GSL's message. */
void gsl_errors_of_memory_return(void);

#endif
