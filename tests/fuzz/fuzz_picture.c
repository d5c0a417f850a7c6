/* Images from elsewhere, as given to `assay compare` or as textures, read by OpenImageIO; HDR skies
 * by our own reader. */
#include "renderer/image/image_oiio.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".picture");
    struct image im;
    struct image_info info;
    struct err e = {""};
    if (!image_inspect(path, &info, &e))
        fuzz_check_line(&e, path);
    if (image_read(path, &im, NULL, &e))
        image_free(&im);
    else
        fuzz_check_line(&e, path);
    /* Targa is recognised by the file's name alone. */
    path = fuzz_file(data, size, size % 2 ? ".tga" : ".picture");
    if (image_read_colours(path, &im, &e)) {
        fuzz_require(im.channels == 3 && im.width > 0 && im.height > 0, "colours without shape");
        image_free(&im);
    } else {
        fuzz_check_line(&e, path);
    }
    if (image_read_hdr(path, &im, &e))
        image_free(&im);
    else
        fuzz_check_line(&e, path);
    return 0;
}
