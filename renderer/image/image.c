#include "image.h"

#include <stdlib.h>
#include <string.h>

bool image_head(struct image *im, int width, int height, int channels, const char *const *names,
                struct err *e)
{
    *im = (struct image){0};
    if (width < 1 || height < 1 || channels < 1)
        return err_set(e, "cannot make an image of %d x %d x %d", width, height, channels);
    im->names = calloc((size_t)channels, sizeof *im->names);
    if (im->names == NULL)
        return err_set(e, "out of memory for an image of %d x %d x %d", width, height, channels);
    im->width = width;
    im->height = height;
    im->channels = channels;
    for (int c = 0; c < channels; c++)
        strncpy(im->names[c], names[c], sizeof im->names[c] - 1);
    return true;
}

bool image_alloc(struct image *im, int width, int height, int channels, const char *const *names,
                 struct err *e)
{
    if (!image_head(im, width, height, channels, names, e))
        return false;
    im->data = calloc((size_t)width * (size_t)height, (size_t)channels * sizeof *im->data);
    if (im->data != NULL)
        return true;
    image_free(im);
    return err_set(e, "out of memory for an image of %d x %d x %d", width, height, channels);
}

void image_free(struct image *im)
{
    for (int i = 0; i < 2 * im->num_attrs; i++)
        free(im->attr[i]);
    free(im->attr);
    free(im->names);
    free(im->data);
    *im = (struct image){0};
}

bool image_set_attr(struct image *im, const char *name, const char *value, struct err *e)
{
    size_t pairs = (size_t)im->num_attrs + 1;
    char **attr = realloc(im->attr, 2 * pairs * sizeof *attr);
    if (attr == NULL)
        return err_set(e, "out of memory for image metadata");
    im->attr = attr;
    char *n = strdup(name), *v = strdup(value);
    if (n == NULL || v == NULL) {
        free(n);
        free(v);
        return err_set(e, "out of memory for image metadata");
    }
    attr[2 * im->num_attrs] = n;
    attr[2 * im->num_attrs + 1] = v;
    im->num_attrs++;
    return true;
}

const char *image_get_attr(const struct image *im, const char *name)
{
    for (int i = 0; i < im->num_attrs; i++)
        if (strcmp(im->attr[2 * i], name) == 0)
            return im->attr[2 * i + 1];
    return NULL;
}

int image_channel(const struct image *im, const char *name)
{
    for (int c = 0; c < im->channels; c++)
        if (strcmp(im->names[c], name) == 0)
            return c;
    return -1;
}
