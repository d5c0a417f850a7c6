// OpenImageIO behind image_library.h, in the one C++ file. Exceptions become error texts here.
extern "C" {
#include "image_library.h"
}

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

struct library_image {
    std::unique_ptr<OIIO::ImageInput> in;
    std::vector<std::pair<std::string, std::string>> texts;
};

namespace
{

void tell(const std::string &text, char *why, size_t size)
{
    size_t n = text.find_last_not_of("\n ");
    std::snprintf(why, size, "%s",
                  n == std::string::npos ? "unknown image error" : text.substr(0, n + 1).c_str());
}

// Runs f, which returns what went wrong or nothing.
template <typename F> bool guarded(char *why, size_t size, F &&f)
{
    try {
        std::string wrong = f();
        if (wrong.empty())
            return true;
        tell(wrong, why, size);
    } catch (const std::exception &x) {
        tell(x.what(), why, size);
    }
    return false;
}

// The library says nothing of a file in a Netpbm format that ends too early.
std::string or_short(const std::string &reason)
{
    return reason.empty() ? "the file ends too early" : reason;
}

enum image_type type_of(OIIO::TypeDesc type)
{
    return type == OIIO::TypeDesc::UINT8    ? IMAGE_INT8
           : type == OIIO::TypeDesc::UINT16 ? IMAGE_INT16
           : type == OIIO::TypeDesc::HALF   ? IMAGE_HALF
           : type == OIIO::TypeDesc::FLOAT  ? IMAGE_FLOAT
                                            : IMAGE_OTHER;
}

struct library_image *open_image(const char *path, const char *format, bool straight, char *why,
                              size_t size)
{
    std::unique_ptr<library_image> p;
    bool ok = guarded(why, size, [&]() -> std::string {
        p = std::make_unique<library_image>();
        OIIO::ImageSpec spec, how;
        if (straight)
            how["oiio:UnassociatedAlpha"] = 1;
        p->in = OIIO::ImageInput::create(format);
        if (!p->in || !p->in->open(path, spec, how))
            return "cannot read: " + (p->in ? p->in->geterror() : OIIO::geterror());
        for (const auto &a : spec.extra_attribs)
            if (a.type() == OIIO::TypeDesc::STRING)
                p->texts.emplace_back(a.name().string(), a.get_string());
        return "";
    });
    return ok ? p.release() : nullptr;
}

void close_image(struct library_image *p)
{
    delete p;
}

bool head_of(struct library_image *p, struct image_info *out, int *depth, double *bytes, char *why,
             size_t size)
{
    *out = {};
    return guarded(why, size, [&]() -> std::string {
        const OIIO::ImageSpec &spec = p->in->spec();
        const std::string format = p->in->format_name();
        bool exr = format == "openexr";
        out->width = exr ? spec.full_width : spec.width;
        out->height = exr ? spec.full_height : spec.height;
        // Clamped: an offset beyond the width of any image shows nothing anyway.
        const long long far = 1 << 20;
        out->data_x = int(std::clamp((long long)spec.x - spec.full_x, -far, far));
        out->data_y = int(std::clamp((long long)spec.y - spec.full_y, -far, far));
        out->data_width = spec.width;
        out->data_height = spec.height;
        out->channels = spec.nchannels;
        *depth = spec.depth;
        *bytes = double(spec.image_bytes(true));
        std::snprintf(out->format, sizeof out->format, "%s", format.c_str());
        size_t smallest = 8;
        for (int c = 0; c < spec.nchannels; c++)
            if (spec.channelformat(c).size() < smallest) {
                smallest = spec.channelformat(c).size();
                out->type = type_of(spec.channelformat(c));
            }
        out->bytes = int(smallest);
        int bits = spec.get_int_attribute("oiio:BitsPerSample", int(8 * smallest));
        if (spec.deep || smallest == 8 || bits != int(8 * smallest))
            out->type = IMAGE_OTHER;
        out->power = format == "jpeg" || format == "targa" ? IMAGE_SRGB : 1;
        out->orientation = spec.get_int_attribute("Orientation", 1);
        out->is_cropped = spec.x != spec.full_x || spec.y != spec.full_y ||
                          spec.width != spec.full_width || spec.height != spec.full_height;
        return "";
    });
}

const char *channel_of(const struct library_image *p, int c)
{
    const auto &names = p->in->spec().channelnames;
    return size_t(c) < names.size() ? names[size_t(c)].c_str() : "";
}

bool read_image(struct library_image *p, float *data, char *why, size_t size)
{
    return guarded(why, size, [&]() -> std::string {
        const OIIO::ImageSpec &spec = p->in->spec();
        if (spec.deep)
            return "has deep pixels";
        // As stored, if all channels are stored alike: to convert, the library takes 16 MB for the smallest image.
        const bool alike = spec.channelformats.empty();
        const bool convert = alike && spec.format != OIIO::TypeDesc::FLOAT;
        std::vector<char> stored(convert ? spec.image_bytes(true) : 0);
        if (!p->in->read_image(0, 0, 0, spec.nchannels,
                               alike ? OIIO::TypeDesc::UNKNOWN : OIIO::TypeDesc::FLOAT,
                               convert ? static_cast<void *>(stored.data()) : data))
            return "cannot read: " + or_short(p->in->geterror());
        const size_t row = size_t(spec.width) * size_t(spec.nchannels);
        for (size_t y = 0; convert && y < size_t(spec.height); y++)
            OIIO::convert_pixel_values(spec.format, &stored[y * row * spec.format.size()],
                                       OIIO::TypeDesc::FLOAT, data + y * row, int(row));
        return "";
    });
}

bool text_of(const struct library_image *p, int k, const char **name, const char **value)
{
    if (size_t(k) >= p->texts.size())
        return false;
    *name = p->texts[size_t(k)].first.c_str();
    *value = p->texts[size_t(k)].second.c_str();
    return true;
}

int parts_of(struct library_image *p)
{
    int parts = 1;
    char why[8];
    // A part to which it cannot seek is not there.
    guarded(why, sizeof why, [&]() -> std::string {
        while (p->in->seek_subimage(parts, 0))
            parts++;
        return "";
    });
    return parts;
}

} // namespace

extern "C" const struct image_library assay_oiio;
const struct image_library assay_oiio = {"OpenImageIO " OIIO_VERSION_STRING,
                                      open_image,
                                      close_image,
                                      head_of,
                                      channel_of,
                                      read_image,
                                      text_of,
                                      parts_of};
