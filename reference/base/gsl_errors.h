/* What the GNU Scientific Library does where it fails. */
#ifndef ASSAY_GSL_ERRORS_H
#define ASSAY_GSL_ERRORS_H

/* By default it ends the program by abort(). From now on, in the whole process, its functions return NULL where memory is out,
 * which all callers here look at; anything else is a bug of ours and ends the program as before, with GSL's line. */
void gsl_errors_of_memory_return(void);

#endif
