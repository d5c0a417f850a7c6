#include "xml_errors.h"

#include <libxml/xmlerror.h>
#include <stddef.h>

#if LIBXML_VERSION >= 21200
typedef const xmlError *xml_complaint;
#else
typedef xmlError *xml_complaint;
#endif

static void note(void *failed, xml_complaint complaint)
{
    (void)complaint;
    *(bool *)failed = true;
}

/* Errors of libxml2's list functions arrive here. */
static void note_text(void *failed, const char *text, ...)
{
    (void)text;
    *(bool *)failed = true;
}

void xml_errors_to(bool *failed)
{
    xmlSetStructuredErrorFunc(failed, failed != NULL ? note : NULL);
    xmlSetGenericErrorFunc(failed, failed != NULL ? note_text : NULL);
    if (failed == NULL)
        xmlResetLastError();
}
