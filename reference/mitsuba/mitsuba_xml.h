/* The elements of a Mitsuba 3 scene file, over libxml2's writer. */
#ifndef ASSAY_MITSUBA_XML_H
#define ASSAY_MITSUBA_XML_H

#include "renderer/base/err.h"
#include "renderer/math/vec.h"

#include <libxml/xmlwriter.h>

/* libxml2 fails only when out of memory; `failed` records that until mitsuba_write() reports it. */
struct mitsuba_xml {
    xmlBufferPtr buffer;
    xmlTextWriterPtr w;
    bool failed;
};

/* Opens <scene>. The caller calls mitsuba_free(), also on failure; until then *x must not move, as
 * libxml2 has the address of `failed`. */
NODISCARD bool mitsuba_new(struct mitsuba_xml *x, struct err *e);
/* Closes it and writes the file, by rename. */
NODISCARD bool mitsuba_write(struct mitsuba_xml *x, const char *path, struct err *e);
void mitsuba_free(struct mitsuba_xml *x);

/* <tag type="type" key="value">, without NULL attributes; mitsuba_end() closes it. */
void mitsuba_begin(struct mitsuba_xml *x, const char *tag, const char *type, const char *key,
                   const char *value);
void mitsuba_end(struct mitsuba_xml *x);

/* <tag name="name" value="value"/>. */
void mitsuba_text(struct mitsuba_xml *x, const char *tag, const char *name, const char *value);
void mitsuba_integer(struct mitsuba_xml *x, const char *name, int value);
void mitsuba_real(struct mitsuba_xml *x, const char *tag, const char *name, double value);
void mitsuba_rgb(struct mitsuba_xml *x, const char *name, rgb c);
/* <tag name="name" x= y= z=/>, tag "point" or "vector". */
void mitsuba_point(struct mitsuba_xml *x, const char *tag, const char *name, vec3 v);
/* The to_world transform that maps +X, +Y, +Z and the origin to these. */
void mitsuba_transform(struct mitsuba_xml *x, vec3 to_x, vec3 to_y, vec3 to_z, vec3 o);

#endif
