/* Checks the structure of an OpenEXR header before the library reads it: the library allocates as many bytes as an
 * attribute claims to have, up to 2 GiB, before it checks that the file is that long. */
#ifndef ASSAY_EXR_HEADER_H
#define ASSAY_EXR_HEADER_H

#include <stdbool.h>
#include <stdio.h>

/* True if all attributes of the headers of all parts lie in the next `left` bytes of f, each as long
 * as it states and as its type requires [OpenEXR file layout]. f stands after the eight bytes of magic
 * number and version; `version` is the latter. */
bool exr_header_is_whole(FILE *f, unsigned version, long left);

#endif
