/* libxml2's error messages while a document is written. */
#ifndef ASSAY_XML_ERRORS_H
#define ASSAY_XML_ERRORS_H

#include <stdbool.h>

/* From now on, in this thread, an error of libxml2 sets *failed and is not printed (libxml2 itself prints a line when
 * out of memory). NULL restores the defaults and frees what libxml2 keeps of the last error. */
void xml_errors_to(bool *failed);

#endif
