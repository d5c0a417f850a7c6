#include "image_oiio.h"

#include "exr_header.h"
#include "image_library.h"
#include "renderer/base/fs.h"

#include <ctype.h>
#include <dlfcn.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

bool image_oiio_file(struct path *path, struct err *e)
{
    /* Beside the programs; beside the directory of the tests; where `make install` puts it; where Debian's packages do, from
     * /usr/lib/TRIPLET. */
    static const char *const places[] = {"oiio.so", "../oiio.so", "../lib/assay/oiio.so",
                                         "../assay/oiio.so"};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        *path = fs_beside_program(places[i]);
        if (access(path->s, R_OK) == 0)
            return true;
    }
    *path = fs_beside_program(places[0]);
    return err_set(e, "cannot load what reads images: %s is not there", path->s);
}

/* The first call loads the library for good; later ones find it again. */
static const struct image_library *load(struct err *e)
{
    struct path path;
    if (!image_oiio_file(&path, e))
        return NULL;
    void *module = dlopen(path.s, RTLD_LAZY | RTLD_LOCAL | RTLD_NODELETE);
    const struct image_library *table = module != NULL ? dlsym(module, IMAGE_LIBRARY_OIIO) : NULL;
    if (table == NULL)
        err_set(e, "cannot load what reads images: %s", dlerror());
    return table;
}

/* What a file is read for. */
enum use { FOR_PIXELS, FOR_COLOURS };

static bool is_targa(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, ".tga") == 0;
}

/* Name of the file's format, told by its first bytes; NULL with a line if it is not one of the documented ones. */
static const char *format_of(const char *path, enum use use, double *size, struct err *e)
{
    struct stat st;
    FILE *f = fs_open(path);
    if (f == NULL || fstat(fileno(f), &st) != 0 || S_ISDIR(st.st_mode)) {
        err_set(e, "%s: cannot read: %s", path, strerror(f != NULL ? EISDIR : errno));
        if (f != NULL)
            fclose(f);
        return NULL;
    }
    *size = (double)st.st_size;
    unsigned char head[8] = {0};
    size_t n = fread(head, 1, sizeof head, f);
    const char *format = NULL, *why = use == FOR_COLOURS
                                          ? "not an OpenEXR, PNG, JPEG, Radiance or Targa file"
                                          : "not an OpenEXR, Radiance, PNG or PFM file";
    if (n == 8 && memcmp(head, "\x76\x2f\x31\x01", 4) == 0) {
        if (exr_header_is_whole(f, head[4] | (unsigned)head[5] << 8, (long)st.st_size - 8))
            format = "openexr";
        why = "the file ends within its header";
    } else if (n == 8 && memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0) {
        format = "png";
    } else if (n >= 2 && head[0] == '#' && head[1] == '?') {
        format = "hdr";
    } else if (use == FOR_COLOURS) {
        if (n >= 3 && memcmp(head, "\xff\xd8\xff", 3) == 0)
            format = "jpeg";
        else if (is_targa(path))
            format = "targa";
    } else if (n >= 3 && head[0] == 'P' && strchr("123456Ff", head[1]) != NULL &&
               isspace(head[2])) {
        format = "pnm";
        if (toupper(head[1]) == 'F' && head[2] == '\r') {
            format = NULL;
            why = "the lines of its header end in CR LF, those of a PFM file in LF";
        }
    }
    fclose(f);
    if (format == NULL)
        err_set(e, "%s: cannot read: %s", path, why);
    return format;
}

static bool check_shape(const char *path, int width, int height, int channels, struct err *e)
{
    return (width >= 1 && height >= 1 && width <= IMAGE_MAX_SIDE && height <= IMAGE_MAX_SIDE &&
            channels >= 1 && channels <= IMAGE_MAX_CHANNELS &&
            (double)width * height * channels <= IMAGE_MAX_FLOATS) ||
           err_set(e, "%s: an image of %d x %d x %d is more than this program takes", path, width,
                   height, channels);
}

/* Floats of a display window that are always allowed, however few of its pixels the file holds. */
#define MAX_SHOWN 1e8

static bool check_size(const char *path, const struct image_info *i, int depth, double bytes,
                       double size, struct err *e)
{
    if (!check_shape(path, i->width, i->height, depth > 1 ? 0 : i->channels, e) ||
        !check_shape(path, i->data_width, i->data_height, i->channels, e))
        return false;
    if (bytes > IMAGE_MAX_EXPANSION * size)
        return err_set(e, "%s: an image of %d x %d x %d cannot be in %.0f bytes", path,
                       i->data_width, i->data_height, i->channels, size);
    return (double)i->width * i->height * i->channels <=
               fmax(MAX_SHOWN, IMAGE_MAX_EXPANSION * size) ||
           err_set(e,
                   "%s: %d x %d x %d stored of an image of %d x %d: more than this program takes",
                   path, i->data_width, i->data_height, i->channels, i->width, i->height);
}

/* Opens a file with the reader for its format. OpenImageIO on its own would try all its readers, for seconds and with
 * gigabytes of memory if none fits. */
static struct library_image *open_image(const char *path, enum use use,
                                        const struct image_library **with, struct image_info *out,
                                        struct err *e)
{
    double size = 0, bytes = 0;
    int depth = 0;
    char why[800];
    const char *format = format_of(path, use, &size, e);
    *with = format == NULL ? NULL : strcmp(format, "png") == 0 ? &image_png_library : load(e);
    if (*with == NULL)
        return NULL;
    struct library_image *p = (*with)->open(path, format, use == FOR_COLOURS, why, sizeof why);
    if (p == NULL || !(*with)->head(p, out, &depth, &bytes, why, sizeof why))
        err_set(e, "%s: %s", path, why);
    else if (use == FOR_COLOURS && (double)out->width * out->height > IMAGE_MAX_TEXELS)
        err_set(e, "%s: %d x %d pixels are more than the %d of a texture", path, out->width,
                out->height, IMAGE_MAX_TEXELS);
    else if (check_size(path, out, depth, bytes, size, e))
        return p;
    if (p != NULL)
        (*with)->close(p);
    return NULL;
}

/* Allocates *im with the shape and channel names of an open file. */
static bool alloc_like(const struct image_library *library, const struct library_image *p,
                       const struct image_info *info, struct image *im, struct err *e)
{
    const char *names[IMAGE_MAX_CHANNELS];
    for (int c = 0; c < info->channels; c++)
        names[c] = library->channel(p, c);
    return image_alloc(im, info->data_width, info->data_height, info->channels, names, e);
}

/* Reads pixels and texts of an open file, and closes it. */
static bool read_pixels(const char *path, const struct image_library *library,
                        struct library_image *p, const struct image_info *info, struct image *out,
                        struct err *e)
{
    struct image im = {0};
    struct err inner;
    char why[800];
    const char *name, *value;
    bool ok = alloc_like(library, p, info, &im, &inner) || err_set(e, "%s: %s", path, inner.msg);
    ok = ok && (library->read(p, im.data, why, sizeof why) || err_set(e, "%s: %s", path, why));
    for (int k = 0; ok && library->text(p, k, &name, &value); k++)
        ok = image_set_attr(&im, name, value, &inner) || err_set(e, "%s: %s", path, inner.msg);
    library->close(p);
    if (!ok) {
        image_free(&im);
        return false;
    }
    *out = im;
    return true;
}

bool image_read(const char *path, struct image *out, bool *half, struct err *e)
{
    struct image_info info;
    const struct image_library *library;
    struct library_image *p = open_image(path, FOR_PIXELS, &library, &info, e);
    if (half != NULL)
        *half = p != NULL && info.bytes < 4;
    return p != NULL && read_pixels(path, library, p, &info, out, e);
}

/* Finds the channels for red, green and blue, all the same for grey. False if there are none. */
static bool colour_channels(const struct image *im, int which[3])
{
    static const char *const names[3] = {"R", "G", "B"};
    int grey = image_channel(im, "Y");
    if (im->channels <= 2 && grey < 0)
        grey = 0;
    for (int c = 0; c < 3; c++) {
        which[c] = image_channel(im, names[c]);
        if (which[c] < 0)
            which[c] = grey;
    }
    return which[0] >= 0 && which[1] >= 0 && which[2] >= 0;
}

static float linear_of(float stored, double power)
{
    double c = (double)stored;
    if (power != IMAGE_SRGB)
        return power == 1 ? stored : (float)pow(c, power);
    return (float)(c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4));
}

/* Converts to linear R, G and B. 8-bit values go through a table, since pow() would take longer than all the rest. */
static bool take_colours(struct image *im, const struct image_info *info, struct image *out,
                         struct err *e)
{
    int which[3];
    float linear[256];
    const bool bytes = info->type == IMAGE_INT8;
    if (!colour_channels(im, which))
        return err_set(e, "no channels R, G and B");
    if (!image_alloc(out, im->width, im->height, 3, (const char *const[]){"R", "G", "B"}, e))
        return false;
    for (int k = 0; k < 256; k++)
        linear[k] = linear_of((float)k * (1.0F / 255), info->power);
    for (size_t i = 0; i < (size_t)im->width * (size_t)im->height; i++)
        for (int c = 0; c < 3; c++) {
            float v = im->data[i * (size_t)im->channels + (size_t)which[c]];
            out->data[3 * i + (size_t)c] =
                bytes ? linear[(int)(255 * v + 0.5F)] : linear_of(v, info->power);
        }
    return true;
}

bool image_read_colours(const char *path, struct image *out, struct err *e)
{
    struct image_info info;
    struct image im = {0};
    const struct image_library *library;
    struct library_image *p = open_image(path, FOR_COLOURS, &library, &info, e);
    if (p == NULL || !read_pixels(path, library, p, &info, &im, e))
        return false;
    bool ok = image_uncrop(&info, &im, e) && take_colours(&im, &info, out, e);
    image_free(&im);
    return ok || err_prefix(e, "%s", path);
}

bool image_inspect(const char *path, struct image_info *out, struct err *e)
{
    const struct image_library *library;
    struct library_image *p = open_image(path, FOR_PIXELS, &library, out, e);
    if (p == NULL)
        return false;
    out->parts = library->parts(p);
    library->close(p);
    return true;
}

bool image_uncrop(const struct image_info *info, struct image *im, struct err *e)
{
    if (!info->is_cropped)
        return true;
    struct image shown;
    const char *names[IMAGE_MAX_CHANNELS];
    for (int c = 0; c < im->channels; c++)
        names[c] = im->names[c];
    if (!image_alloc(&shown, info->width, info->height, im->channels, names, e))
        return false;
    size_t floats = (size_t)im->channels;
    for (int y = 0; y < im->height; y++)
        for (int x = 0; x < im->width; x++) {
            int to_x = info->data_x + x, to_y = info->data_y + y;
            if (to_x >= 0 && to_x < shown.width && to_y >= 0 && to_y < shown.height)
                memcpy(shown.data + floats * ((size_t)to_y * (size_t)shown.width + (size_t)to_x),
                       im->data + floats * ((size_t)y * (size_t)im->width + (size_t)x),
                       floats * sizeof *im->data);
        }
    image_free(im);
    *im = shown;
    return true;
}

const char *image_oiio_version(struct err *e)
{
    const struct image_library *library = load(e);
    return library != NULL ? library->version : NULL;
}
