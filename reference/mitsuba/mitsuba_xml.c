#include "mitsuba_xml.h"

#include "renderer/base/fs.h"
#include "reference/base/xml_errors.h"

#include <stdio.h>

static void check(struct mitsuba_xml *x, int result)
{
    x->failed = x->failed || result < 0;
}

static void attribute(struct mitsuba_xml *x, const char *name, const char *value)
{
    check(x, xmlTextWriterWriteAttribute(x->w, BAD_CAST name, BAD_CAST value));
}

bool mitsuba_new(struct mitsuba_xml *x, struct err *e)
{
    *x = (struct mitsuba_xml){.w = NULL};
    xml_errors_to(&x->failed);
    x->buffer = xmlBufferCreate();
    if (x->buffer != NULL)
        x->w = xmlNewTextWriterMemory(x->buffer, 0);
    if (x->w == NULL)
        return err_set(e, "out of memory for the Mitsuba scene");
    check(x, xmlTextWriterSetIndent(x->w, 1));
    check(x, xmlTextWriterStartDocument(x->w, NULL, "utf-8", NULL));
    check(x, xmlTextWriterWriteComment(
                 x->w, BAD_CAST " mitsuba -m scalar_rgb -D spp=64 -D seed=1 -o OUT.exr THIS "));
    mitsuba_begin(x, "scene", NULL, "version", "3.0.0");
    return true;
}

bool mitsuba_write(struct mitsuba_xml *x, const char *path, struct err *e)
{
    struct out_file out;
    check(x, xmlTextWriterEndDocument(x->w));
    check(x, xmlTextWriterFlush(x->w));
    if (x->failed)
        return err_set(e, "%s: out of memory", path);
    if (!out_open(&out, path, e))
        return false;
    fwrite(xmlBufferContent(x->buffer), 1, (size_t)xmlBufferLength(x->buffer), out.f);
    return out_commit(&out, e);
}

void mitsuba_free(struct mitsuba_xml *x)
{
    if (x->w != NULL)
        xmlFreeTextWriter(x->w);
    if (x->buffer != NULL)
        xmlBufferFree(x->buffer);
    xml_errors_to(NULL);
    *x = (struct mitsuba_xml){0};
}

void mitsuba_begin(struct mitsuba_xml *x, const char *tag, const char *type, const char *key,
                   const char *value)
{
    check(x, xmlTextWriterStartElement(x->w, BAD_CAST tag));
    if (type != NULL)
        attribute(x, "type", type);
    if (key != NULL)
        attribute(x, key, value);
}

void mitsuba_end(struct mitsuba_xml *x)
{
    check(x, xmlTextWriterEndElement(x->w));
}

void mitsuba_text(struct mitsuba_xml *x, const char *tag, const char *name, const char *value)
{
    mitsuba_begin(x, tag, NULL, "name", name);
    attribute(x, "value", value);
    mitsuba_end(x);
}

void mitsuba_integer(struct mitsuba_xml *x, const char *name, int value)
{
    char number[16];
    snprintf(number, sizeof number, "%d", value);
    mitsuba_text(x, "integer", name, number);
}

void mitsuba_real(struct mitsuba_xml *x, const char *tag, const char *name, double value)
{
    char number[32];
    snprintf(number, sizeof number, "%.9g", value);
    mitsuba_text(x, tag, name, number);
}

void mitsuba_rgb(struct mitsuba_xml *x, const char *name, rgb c)
{
    char numbers[96];
    snprintf(numbers, sizeof numbers, "%.9g, %.9g, %.9g", (double)c.r, (double)c.g, (double)c.b);
    mitsuba_text(x, "rgb", name, numbers);
}

void mitsuba_point(struct mitsuba_xml *x, const char *tag, const char *name, vec3 v)
{
    const char *const axis[3] = {"x", "y", "z"};
    const float value[3] = {v.x, v.y, v.z};
    mitsuba_begin(x, tag, NULL, "name", name);
    for (int k = 0; k < 3; k++) {
        char number[32];
        snprintf(number, sizeof number, "%.9g", (double)value[k]);
        attribute(x, axis[k], number);
    }
    mitsuba_end(x);
}

void mitsuba_transform(struct mitsuba_xml *x, vec3 to_x, vec3 to_y, vec3 to_z, vec3 o)
{
    char m[512];
    snprintf(m, sizeof m, "%.9g %.9g %.9g %.9g  %.9g %.9g %.9g %.9g  %.9g %.9g %.9g %.9g  0 0 0 1",
             (double)to_x.x, (double)to_y.x, (double)to_z.x, (double)o.x, (double)to_x.y,
             (double)to_y.y, (double)to_z.y, (double)o.y, (double)to_x.z, (double)to_y.z,
             (double)to_z.z, (double)o.z);
    mitsuba_begin(x, "transform", NULL, "name", "to_world");
    mitsuba_begin(x, "matrix", NULL, "value", m);
    mitsuba_end(x);
    mitsuba_end(x);
}
