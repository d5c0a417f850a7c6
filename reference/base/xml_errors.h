/* What libxml2 says while a document is written. */
#ifndef ASSAY_XML_ERRORS_H
#define ASSAY_XML_ERRORS_H

#include <stdbool.h>

/* From now on, in this thread, a complaint sets *failed and is not printed: where memory is out libxml2 would write a line of
 * its own on stderr. NULL: as in the beginning; what the library keeps of the last complaint is given back. */
void xml_errors_to(bool *failed);

#endif
