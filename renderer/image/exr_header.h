/* The outline of an OpenEXR header, read before OpenEXR reads it: that library reserves what an attribute says it
 * is long, up to 2 GiB, before it looks whether the file is. */
#ifndef ASSAY_EXR_HEADER_H
#define ASSAY_EXR_HEADER_H

#include <stdbool.h>
#include <stdio.h>

/* f: after the eight bytes of magic number and version, `version` the second of them. Whether all attributes of all
 * parts' headers lie in the `left` bytes that follow, each as long as it says and its type has to be [OpenEXR file layout]. */
bool exr_header_is_whole(FILE *f, unsigned version, long left);

#endif
