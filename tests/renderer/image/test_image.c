/* Our readers and writers of image files against OpenImageIO's, a route of its own: the same bits of
 * every channel, whichever way OpenEXR and RGBE pack them; and files that are cut short or damaged. */
#include "renderer/base/fs.h"
#include "renderer/image/image_library.h"
#include "renderer/math/sampler.h"
#include "reference/base/process.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <dlfcn.h>
#include <openexr.h>
#include <png.h>
#include <sys/stat.h>
#include <zlib.h>

enum { WIDTH = 37, HEIGHT = 29, CHANNELS = 5 };
static const char *const channel[CHANNELS] = {"R", "G", "B", "variance.R", "Z"};

/* Positive numbers of many magnitudes, with smooth parts that pack well. */
static struct image make_image(void)
{
    struct image im;
    struct err e = {""};
    assert_true(image_alloc(&im, WIDTH, HEIGHT, CHANNELS, channel, &e));
    for (int i = 0; i < WIDTH * HEIGHT * CHANNELS; i++) {
        struct sample4 u = sampler_get(5, (uint32_t)i, 0, 0, 0);
        im.data[i] = i % 3 == 0 ? 0.25f : u.u[0] * (u.u[1] < 0.1f ? 1000 : 1);
    }
    assert_true(image_set_attr(&im, "assay:unit", "sample", &e));
    assert_true(image_set_attr(&im, "assay:empty", "", &e));
    return im;
}

/* Converts source.exr by a program that does not use our code. */
static void oiiotool(const char *const *options, const char *to)
{
    struct err e = {""};
    const char *argv[16] = {"oiiotool", test_path("source.exr")};
    int n = 2;
    for (; *options != NULL; options++)
        argv[n++] = *options;
    argv[n++] = "-o";
    argv[n++] = test_path(to);
    const struct process p = {.argv = argv, .timeout_s = 60};
    MUST(process_run(&p, NULL, &e));
}

static void assert_same(const struct image *a, const struct image *b)
{
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    assert_int_equal(a->channels, b->channels);
    for (int c = 0; c < a->channels; c++) {
        int other = image_channel(b, a->names[c]);
        assert_true(other >= 0);
        for (size_t i = 0; i < (size_t)a->width * (size_t)a->height; i++) {
            size_t n = (size_t)a->channels;
            assert_memory_equal(&a->data[n * i + (size_t)c], &b->data[n * i + (size_t)other],
                                sizeof(float));
        }
    }
}

/* What both readers find; ours comes back. */
static struct image read_both(const char *name, bool is_half)
{
    const char *path = test_path(name);
    struct image ours, theirs;
    bool half = !is_half;
    struct err e = {""};
    bool is_hdr = strstr(name, ".hdr") != NULL;
    MUST(is_hdr ? image_read_hdr(path, &ours, &e) : image_read_exr(path, &ours, &half, &e));
    MUST(image_read(path, &theirs, NULL, &e));
    assert_true(is_hdr || half == is_half);
    assert_same(&ours, &theirs);
    image_free(&theirs);
    return ours;
}

TEST(exr_round_trip)
{
    struct image want = make_image(), got = read_both("source.exr", false);
    assert_same(&want, &got);
    assert_string_equal(image_get_attr(&got, "assay:unit"), "sample");
    assert_string_equal(image_get_attr(&got, "assay:empty"), "");
    image_free(&want);
    image_free(&got);
}

/* Chunks of sixteen rows, whole, cut short or of a single number, of noise in every bit, which no packing makes
 * shorter, and of one value. */
TEST(exr_of_any_shape)
{
    static const int shape[][3] = {{1, 1, 1}, {3, 16, 1}, {61, 17, 3}, {40, 33, 5}};
    for (size_t k = 0; k < 2 * COUNT(shape); k++) {
        const int *s = shape[k / 2];
        OWN(image) im;
        struct err e = {""};
        assert_true(image_alloc(&im, s[0], s[1], s[2], channel, &e));
        for (int i = 0; i < s[0] * s[1] * s[2]; i++) {
            struct sample4 u = sampler_get(6, (uint32_t)i, 0, 0, 0);
            uint32_t bits = (uint32_t)(u.u[0] * 65536) << 16 | (uint32_t)(u.u[1] * 65536);
            if (k % 2 == 0)
                bits &= ~(1u << 30); /* finite */
            else
                bits = 0x3f800000;
            memcpy(&im.data[i], &bits, sizeof bits);
        }
        MUST(image_write_exr(test_path("shape.exr"), &im, &e));
        OWN(image) got = read_both("shape.exr", false);
        assert_same(&im, &got);
    }
}

TEST(exr_as_others_write_it)
{
    static const struct {
        const char *options[8];
        bool is_half;
    } cases[] = {
        {{"--compression", "none", NULL}, false},
        {{"--compression", "none", "-d", "half", NULL}, true},
        {{"--compression", "rle", NULL}, false},
        {{"--compression", "zips", NULL}, false},
        {{"--compression", "piz", "-d", "half", NULL}, true},
        {{"--compression", "pxr24", "-d", "half", NULL}, true},
        {{"--compression", "dwaa", "-d", "half", NULL}, true},
        {{"--compression", "zip", "--tile", "16", "8", NULL}, false},
        {{"--compression", "piz", "-d", "half", "--tile", "64", "64", NULL}, true},
        {{"--origin", "+11-7", NULL}, false},
        {{"--origin", "-5+3", "--tile", "16", "16", NULL}, false},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        oiiotool(cases[i].options, "other.exr");
        struct image im = read_both("other.exr", cases[i].is_half);
        image_free(&im);
    }
}

TEST(hdr_as_others_write_it)
{
    static const char *const wide[] = {"--ch", "R,G,B", NULL};
    static const char *const narrow[] = {"--ch",    "R,G,B",        "--crop",
                                         "5x4+0+0", "--fullpixels", NULL};
    const char *const *const options[] = {wide, narrow};
    for (int i = 0; i < 2; i++) {
        oiiotool(options[i], "other.hdr");
        OWN(image) im = read_both("other.hdr", false);
        assert_int_equal(im.width, i == 0 ? WIDTH : 5);
    }
}

enum { BYTES = WIDTH * HEIGHT * 3 };

static void assert_bytes(const char *path, const uint8_t *pixel, struct image *got)
{
    struct err e = {""};
    MUST(image_read(path, got, NULL, &e));
    assert_true(got->width == WIDTH && got->height == HEIGHT && got->channels == 3);
    for (size_t i = 0; i < BYTES; i++)
        assert_int_equal(lroundf(got->data[i] * 255), pixel[i]);
}

TEST(png_round_trip)
{
    const char *path = test_path("a.png"), *copy = test_path("b.png");
    uint8_t pixel[BYTES], *bytes = NULL;
    size_t size = 0;
    struct image got;
    struct err e = {""};
    for (size_t i = 0; i < sizeof pixel; i++)
        pixel[i] = (uint8_t)(i * 7 + i / 50);
    MUST(image_write_png(path, WIDTH, HEIGHT, pixel, &e) &&
         image_encode_png(WIDTH, HEIGHT, pixel, &bytes, &size, &e));
    test_write(copy, bytes, size);
    free(bytes);
    for (int k = 0; k < 2; k++) {
        assert_bytes(k == 0 ? path : copy, pixel, &got);
        image_free(&got);
    }
    REFUSES(image_write_png("/nowhere/a.png", WIDTH, HEIGHT, pixel, &e),
            "/nowhere/a.png: cannot write: ");
}

/* Read back by OpenImageIO. */
TEST(png_texts)
{
    static char words[20000];
    memset(words, 'w', sizeof words - 1);
    const struct image_attr text[] = {
        {"assay:seed", "7"}, {"assay:adaptive", ""}, {"assay:settings", words}};
    uint8_t pixel[BYTES];
    OWN(image) got;
    struct err e = {""};
    for (size_t i = 0; i < sizeof pixel; i++)
        pixel[i] = (uint8_t)(i * 11 + i / 70);
    const char *path = test_path("texts.png");
    MUST(image_write_png_texts(path, WIDTH, HEIGHT, pixel, text, COUNT(text), &e));
    assert_bytes(path, pixel, &got);
    for (size_t i = 0; i < COUNT(text); i++) {
        assert_non_null(image_get_attr(&got, text[i].name));
        assert_string_equal(image_get_attr(&got, text[i].name), text[i].value);
    }
    assert_null(image_get_attr(&got, "assay:scene"));
}

static void write_odd_png(const char *path, int type, int bits, bool passes, bool clear)
{
    png_color colours[256];
    uint8_t row[8 * WIDTH], alphas[256];
    const png_color_16 hidden = {.red = 3, .green = 5, .blue = 9, .gray = 1};
    FILE *f = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    assert_non_null(f);
    png_init_io(png, f);
    png_set_IHDR(png, info, WIDTH, HEIGHT, bits, type,
                 passes ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    for (int i = 0; i < 256; i++) {
        colours[i] = (png_color){(png_byte)(i * 7), (png_byte)(255 - i), (png_byte)(i * i)};
        alphas[i] = i % 3 == 0 ? 255 : (uint8_t)i;
    }
    if (type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, colours, 1 << bits);
    if (clear)
        png_set_tRNS(png, info, alphas, 1 << (bits < 8 ? bits : 7), &hidden);
    png_write_info(png, info);
    for (int pass = png_set_interlace_handling(png); pass > 0; pass--)
        for (int y = 0; y < HEIGHT; y++) {
            for (int i = 0; i < 8 * WIDTH; i++)
                row[i] = (uint8_t)(i * 37 + y * y * 11);
            png_write_row(png, row);
        }
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    assert_int_equal(fclose(f), 0);
}

/* Every kind of PNG [11.2.2]: grey, colours and palettes of all depths, in one pass or seven, with a colour or a palette that is
 * transparent. The other route is OpenImageIO's reader. */
TEST(png_as_others_write_it)
{
    static const struct {
        int type, least, most;
    } kinds[] = {{PNG_COLOR_TYPE_GRAY, 1, 16},
                 {PNG_COLOR_TYPE_RGB, 8, 16},
                 {PNG_COLOR_TYPE_PALETTE, 1, 8},
                 {PNG_COLOR_TYPE_GRAY_ALPHA, 8, 16},
                 {PNG_COLOR_TYPE_RGB_ALPHA, 8, 16}};
    static float theirs[4 * WIDTH * HEIGHT];
    char why[200];
    int depth;
    double bytes;
    struct image ours;
    struct image_info info, other;
    struct path module;
    struct err e = {""};
    MUST(image_oiio_file(&module, &e));
    void *handle = dlopen(module.s, RTLD_LAZY | RTLD_LOCAL | RTLD_NODELETE);
    const struct image_library *oiio = dlsym(handle, IMAGE_LIBRARY_OIIO);
    const char *name = test_path("odd.png");
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        for (int bits = kinds[k].least; bits <= kinds[k].most; bits *= 2)
            for (int form = 0; form < 4; form++) {
                bool has_alpha = kinds[k].type & PNG_COLOR_MASK_ALPHA,
                     clear = form / 2 && !has_alpha;
                write_odd_png(name, kinds[k].type, bits, form % 2, clear);
                MUST(image_inspect(name, &info, &e));
                MUST(image_read(name, &ours, NULL, &e));
                struct library_image *p = oiio->open(name, "png", true, why, sizeof why);
                assert_true(p != NULL && oiio->head(p, &other, &depth, &bytes, why, sizeof why) &&
                            oiio->read(p, theirs, why, sizeof why));
                assert_true(info.type == other.type && info.bytes == other.bytes);
                assert_true(ours.width == WIDTH && ours.height == HEIGHT);
                assert_true(ours.channels == other.channels);
                assert_int_equal(image_channel(&ours, "A") >= 0, clear || has_alpha);
                for (int c = 0; c < ours.channels; c++)
                    assert_string_equal(ours.names[c], oiio->channel(p, c));
                assert_memory_equal(ours.data, theirs,
                                    sizeof(float) * WIDTH * HEIGHT * (size_t)ours.channels);
                oiio->close(p);
                image_free(&ours);
            }
}

/* The Exif chunk in which cameras store the orientation, in both byte orders [TIFF 6.0, 2]. */
TEST(png_that_is_turned)
{
    uint8_t exif[2][26] = {"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0",
                           "MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x08\0\0\0\0\0"};
    static const uint8_t pixel[3];
    const char *path = test_path("turned.png");
    struct image_info info;
    struct err e = {""};
    for (int k = 0; k < 2; k++) {
        FILE *f = fopen(path, "wb");
        png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
        png_infop head = png_create_info_struct(png);
        assert_non_null(f);
        png_init_io(png, f);
        png_set_IHDR(png, head, 1, 1, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                     PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
        png_set_eXIf_1(png, head, sizeof exif[k], exif[k]);
        png_write_info(png, head);
        png_write_row(png, pixel);
        png_write_end(png, NULL);
        png_destroy_write_struct(&png, &head);
        assert_int_equal(fclose(f), 0);
        MUST(image_inspect(path, &info, &e));
        assert_int_equal(info.orientation, k == 0 ? 6 : 8);
    }
}

static bool read_bytes(const char *name, const void *bytes, size_t size, struct err *e)
{
    const char *path = test_path(name);
    struct image im;
    test_write(path, bytes, size);
    bool ok = strstr(name, ".hdr") != NULL   ? image_read_hdr(path, &im, e)
              : strstr(name, ".png") != NULL ? image_read(path, &im, NULL, e)
                                             : image_read_exr(path, &im, NULL, e);
    if (ok)
        image_free(&im);
    return ok;
}

/* Every file that ends too early is refused, with a line that names it. Damage to a byte is refused or
 * read as other numbers; the sanitizers watch. */
TEST(damaged_files)
{
    static const char *const names[] = {"source.exr", "tiled.exr", "other.hdr", "texts.png"};
    static const char *const tiles[] = {"--compression", "zip", "--tile", "16", "8", NULL};
    oiiotool(tiles, "tiled.exr");
    for (size_t k = 0; k < COUNT(names); k++) {
        struct err e = {""};
        struct stat st;
        char name[16], *bytes = test_read(test_path(names[k]));
        assert_int_equal(stat(test_path(names[k]), &st), 0);
        const size_t size = (size_t)st.st_size;
        assert_true(size > 100);
        snprintf(name, sizeof name, "damaged%s", strrchr(names[k], '.'));
        assert_true(read_bytes(name, bytes, size, &e));
        for (size_t end = 0; end < size; end += 1 + size / 97) {
            e.msg[0] = '\0';
            if (read_bytes(name, bytes, end, &e))
                fail_msg("%s: its first %zu of %zu bytes are taken for all", names[k], end, size);
            assert_non_null(strstr(e.msg, name));
            assert_null(strchr(e.msg, '\n'));
        }
        for (uint32_t i = 0; i < 400; i++) {
            struct sample4 u = sampler_get(6, i, (uint32_t)k, 0, 0);
            size_t at = (size_t)((i % 2 ? u.u[0] : u.u[0] * 0.1f) * (float)size);
            char before = bytes[at];
            bytes[at] ^= (char)(uint8_t)(1 + 254 * u.u[1]);
            (void)!read_bytes(name, bytes, size, &e);
            bytes[at] = before;
        }
        free(bytes);
    }
}

/* A file by OpenEXR's own writer: 4 lines of 8 pixels, uncompressed; deep: a sample for each pixel, whose number comes with it. */
static bool write_by_openexr(const char *path, exr_storage_t storage, exr_pixel_type_t type)
{
    enum { W = 8, H = 4 };
    int part, samples[W];
    float light[W];
    exr_context_t f = NULL;
    for (int x = 0; x < W; x++) {
        light[x] = 0.5f + (float)x;
        samples[x] = x + 1; /* counts so far */
    }
    bool ok =
        exr_start_write(&f, path, EXR_WRITE_FILE_DIRECTLY, NULL) == EXR_ERR_SUCCESS &&
        exr_add_part(f, "lines", storage, &part) == EXR_ERR_SUCCESS &&
        exr_initialize_required_attr_simple(f, part, W, H, EXR_COMPRESSION_NONE) ==
            EXR_ERR_SUCCESS &&
        exr_add_channel(f, part, "R", type, EXR_PERCEPTUALLY_LINEAR, 1, 1) == EXR_ERR_SUCCESS &&
        (storage == EXR_STORAGE_SCANLINE || exr_set_version(f, part, 1) == EXR_ERR_SUCCESS) &&
        exr_write_header(f) == EXR_ERR_SUCCESS;
    for (int y = 0; ok && y < H; y++)
        ok = (storage == EXR_STORAGE_SCANLINE
                  ? exr_write_scanline_chunk(f, part, y, light, sizeof light)
                  : exr_write_deep_scanline_chunk(f, part, y, light, sizeof light, sizeof light,
                                                  samples, sizeof samples)) == EXR_ERR_SUCCESS;
    return exr_finish(&f) == EXR_ERR_SUCCESS && ok;
}

/* Control: floats, by the same writer. */
TEST(deep_pixels_and_whole_numbers_are_refused)
{
    struct image im;
    struct err e;
    bool half;
    const char *plain = test_path("plain.exr"), *whole = test_path("whole.exr"),
               *deep = test_path("deep.exr");
    assert_true(write_by_openexr(plain, EXR_STORAGE_SCANLINE, EXR_PIXEL_FLOAT));
    MUST(image_read_exr(plain, &im, &half, &e));
    assert_true(im.width == 8 && im.height == 4 && im.data[0] == 0.5f && im.data[31] == 7.5f);
    image_free(&im);
    assert_true(write_by_openexr(whole, EXR_STORAGE_SCANLINE, EXR_PIXEL_UINT));
    REFUSES(image_read_exr(whole, &im, &half, &e), "whole.exr: channel R is not a float");
    assert_true(write_by_openexr(deep, EXR_STORAGE_DEEP_SCANLINE, EXR_PIXEL_FLOAT));
    REFUSES(image_read_exr(deep, &im, &half, &e), "deep.exr: has deep pixels");
    REFUSES(image_read_exr_head(deep, &im, &e), "deep.exr: has deep pixels");
    REFUSES(image_read(deep, &im, &half, &e), "deep.exr: has deep pixels");
}

/* Writes an image of 8 x 8 of the source's name, one colour, by oiiotool; reads its colours. */
static struct image read_flat(const char *name, const char *channels, const char *colour,
                              const char *const attribute[2], const char *depth)
{
    char fill[64];
    struct err e = {""};
    struct image im;
    snprintf(fill, sizeof fill, "--fill:color=%s", colour);
    const char *const options[] = {"--create",   "8x8",        channels, fill,  "8x8", "--attrib",
                                   attribute[0], attribute[1], "-d",     depth, NULL};
    oiiotool(options, name);
    MUST(image_read_colours(test_path(name), &im, &e));
    assert_true(im.width == 8 && im.height == 8 && im.channels == 3);
    return im;
}

/* By hand [IEC 61966-2-1]: 0.5 is ((0.5 + 0.055)/1.055)^2.4 = 0.21404, 0.25 is 0.05088, 0.03 is 0.03/12.92. Files keep steps of 1/255
 * (1/65535, JPEG a little more), of which the curve is at most 2.3 times as steep. Alpha changes no colour: 0.25 at an alpha of 0.5
 * is stored as 0.5. */
TEST(colours_are_linear)
{
    static const char *const nothing[2] = {"assay:nothing", "1"};
    static const char *const linear[2] = {"oiio:ColorSpace", "Linear"};
    static const char *const gamma[2] = {"oiio:ColorSpace", "GammaCorrected1.8"};
    static const struct {
        const char *name, *channels, *colour, *const *attribute, *depth;
        double expected[3], tolerance;
    } cases[] = {
        {"rgb.png", "3", "0.5,0.25,0.03", nothing, "uint8", {0.21404, 0.05088, 0.002322}, 5e-3},
        {"rgb16.png", "3", "0.5,0.25,0.03", nothing, "uint16", {0.21404, 0.05088, 0.002322}, 3e-5},
        {"rgba.png",
         "4",
         "0.25,0.125,0.015,0.5",
         nothing,
         "uint16",
         {0.21404, 0.05088, 0.002322},
         6e-5},
        {"grey.png", "1", "0.5", nothing, "uint16", {0.21404, 0.21404, 0.21404}, 3e-5},
        {"linear.png", "3", "0.5,0.25,0.03", linear, "uint16", {0.5, 0.25, 0.03}, 2e-5},
        {"gamma.png", "3", "0.5,0.25,0.03", gamma, "uint16", {0.28717, 0.08247, 0.0018152}, 5e-5},
        {"rgb.jpg", "3", "0.5,0.25,0.75", nothing, "uint8", {0.21404, 0.05088, 0.52252}, 2e-2},
        {"rgb.tga", "3", "0.5,0.25,0.03", nothing, "uint8", {0.21404, 0.05088, 0.002322}, 5e-3},
        {"rgb.exr", "3", "0.5,0.25,1.5", nothing, "float", {0.5, 0.25, 1.5}, 1e-6},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        OWN(image)
        im = read_flat(cases[i].name, cases[i].channels, cases[i].colour, cases[i].attribute,
                       cases[i].depth);
        for (int k = 0; k < 3 * 64; k++)
            if (!(fabs((double)im.data[k] - cases[i].expected[k % 3]) <= cases[i].tolerance))
                fail_msg("%s: %g, expected %g", cases[i].name, (double)im.data[k],
                         cases[i].expected[k % 3]);
    }
    struct image im;
    struct err e = {""};
    REFUSES(image_read(test_path("rgb.jpg"), &im, NULL, &e),
            "not an OpenEXR, Radiance, PNG or PFM");
    test_write(test_path("short.pfm"), "PF\n2 2\n-1\n0123456789", 20);
    REFUSES(image_read(test_path("short.pfm"), &im, NULL, &e),
            "short.pfm: cannot read: the file ends too early");
    test_write(test_path("windows.pfm"), "PF\r\n1 1\r\n-1\r\n0123456789ab", 25);
    REFUSES(image_read(test_path("windows.pfm"), &im, NULL, &e), "header end in CR LF");
}

/* The place of every texel, among channels that are no colours. */
TEST(colours_stay_where_they_are)
{
    struct err e = {""};
    struct image im, source = make_image();
    MUST(image_read_colours(test_path("source.exr"), &im, &e));
    assert_true(im.width == WIDTH && im.height == HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_memory_equal(im.data + 3 * i, source.data + CHANNELS * i, 3 * sizeof(float));
    image_free(&im);
    image_free(&source);
    static const char *const depth[] = {"--ch", "Z,variance.R,G", NULL};
    oiiotool(depth, "depth.exr");
    REFUSES(image_read_colours(test_path("depth.exr"), &im, &e),
            "depth.exr: no channels R, G and B");
    REFUSES(image_read_colours(test_path("none.png"), &im, &e),
            "none.png: cannot read: No such file");
}

/* The head of a PNG says 9000 x 9000, which is more than a texture has. */
TEST(textures_have_a_limit)
{
    uint8_t bytes[8 + 25 + 12] =
        "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x23\x28\0\0\x23\x28\x08\x02\0\0\0";
    struct image im;
    struct err e = {""};
    unsigned long check = crc32(0, bytes + 12, 17);
    for (int i = 0; i < 4; i++)
        bytes[29 + i] = (uint8_t)(check >> (24 - 8 * i));
    memcpy(bytes + 33, "\0\0\0\0IDAT\x35\xaf\x06\x1e", 12);
    test_write(test_path("huge.png"), bytes, sizeof bytes);
    REFUSES(image_read_colours(test_path("huge.png"), &im, &e),
            "9000 x 9000 pixels are more than the 67108864 of a texture");
}

static int setup(void **state)
{
    (void)state;
    struct err e = {""};
    OWN(image) im = make_image();
    MUST(image_write_exr(test_path("source.exr"), &im, &e));
    return 0;
}

TEST_GROUP(setup, NULL)
