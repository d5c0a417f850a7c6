/* What libxml2 says while a document is written. */
#ifndef ASSAY_XML_ERRORS_H
#define ASSAY_XML_ERRORS_H

#include <stdbool.h>

/* From now on, in this thread, an error of libxml2 sets *failed and is not printed; out of memory it would print a line of its
 * own. NULL: restores the defaults and frees what libxml2 keeps of the last error. */
void xml_errors_to(bool *failed);

#endif
