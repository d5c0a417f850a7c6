/* Checks the structure of an OpenEXR header before the library reads it: the library allocates as many bytes as an
 * attribute claims to have, up to 2 GiB, before it checks that the file is that long. */
#ifndef ASSAY_EXR_HEADER_H
#define ASSAY_EXR_HEADER_H

#include <stdbool.h>
#include <stdio.h>

/* f: after the eight bytes of magic number and version, `version` the second of them. Whether all
 * attributes of all parts' headers lie in the `left` bytes that follow, each as long as it says and
 * its type has to be [OpenEXR file layout]. */
bool exr_header_is_whole(FILE *f, unsigned version, long left);

#endif
