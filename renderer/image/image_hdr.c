/* Radiance images, RGBE. A reader of our own, since the small libraries return black pixels where a
 * file is cut short. Format: G. Ward, Real pixels, in Graphics Gems II, 1991. */
#include "image.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

enum { MIN_PACKED = 8, MAX_PACKED = 0x7fff };

/* Reads the header, up to and including the line with the size. */
static bool read_header(FILE *f, int *width, int *height)
{
    char line[256];
    bool is_rgbe = false;
    if (fgets(line, sizeof line, f) == NULL || strncmp(line, "#?", 2) != 0)
        return false;
    while (fgets(line, sizeof line, f) != NULL && strcmp(line, "\n") != 0)
        is_rgbe |= strcmp(line, "FORMAT=32-bit_rle_rgbe\n") == 0;
    char end;
    return is_rgbe && fgets(line, sizeof line, f) != NULL &&
           sscanf(line, "-Y %9d +X %9d%c", height, width, &end) == 3 && end == '\n';
}

/* Reads one component of a row, run-length encoded. */
static bool read_runs(FILE *f, int width, uint8_t *rgbe)
{
    for (int x = 0; x < width;) {
        int n = getc(f), value = n > 128 ? getc(f) : 0;
        bool is_run = n > 128;
        n = is_run ? n - 128 : n;
        if (n <= 0 || n > width - x || value == EOF)
            return false;
        for (; n > 0; n--, x++) {
            int v = is_run ? value : getc(f);
            if (v == EOF)
                return false;
            rgbe[4 * (size_t)x] = (uint8_t)v;
        }
    }
    return true;
}

static bool read_row(FILE *f, int width, uint8_t *rgbe)
{
    if (fread(rgbe, 1, 4, f) != 4)
        return false;
    bool packed =
        width >= MIN_PACKED && width <= MAX_PACKED && rgbe[0] == 2 && rgbe[1] == 2 && rgbe[2] < 128;
    if (!packed) {
        size_t left = 4 * (size_t)(width - 1);
        return fread(rgbe + 4, 1, left, f) == left;
    }
    if (rgbe[2] * 256 + rgbe[3] != width)
        return false;
    for (int c = 0; c < 4; c++)
        if (!read_runs(f, width, rgbe + c))
            return false;
    return true;
}

bool image_read_hdr(const char *path, struct image *out, struct err *e)
{
    static const char *const names[] = {"R", "G", "B"};
    struct image im = {0};
    uint8_t rgbe[4 * IMAGE_MAX_SIDE];
    int width, height;
    FILE *f = fs_open(path);
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    struct stat st;
    bool ok = fstat(fileno(f), &st) == 0 && read_header(f, &width, &height) && width > 0 &&
              height > 0 && width <= IMAGE_MAX_SIDE && height <= IMAGE_MAX_SIDE;
    if (!ok)
        err_set(e, "%s: cannot read: not a Radiance image (RGBE, rows from the top)", path);
    else if (4.0 * width * height > IMAGE_MAX_EXPANSION * (double)st.st_size)
        ok = err_set(e, "%s: an image of %d x %d cannot be in %lld bytes", path, width, height,
                     (long long)st.st_size);
    else if (!image_alloc(&im, width, height, 3, names, e))
        ok = err_prefix(e, "%s", path);
    for (int y = 0; ok && y < height; y++) {
        ok = read_row(f, width, rgbe);
        if (!ok)
            err_set(e, "%s: cannot read: row %d is damaged or missing", path, y);
        for (int x = 0; ok && x < width; x++) {
            const uint8_t *p = rgbe + 4 * (size_t)x;
            float unit = p[3] > 0 ? ldexpf(1, p[3] - (128 + 8)) : 0;
            for (int c = 0; c < 3; c++)
                im.data[((size_t)y * (size_t)width + (size_t)x) * 3 + (size_t)c] = unit * p[c];
        }
    }
    fclose(f);
    if (!ok)
        image_free(&im);
    else
        *out = im;
    return ok;
}
