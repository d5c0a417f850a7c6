// The one C++ file: image_oiio.h. Exceptions end here, as text in struct err.
extern "C" {
#include "exr_header.h"
#include "image_oiio.h"
}

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

namespace
{

// Runs f; an exception or false becomes a line that starts with `path`.
template <typename F> bool guarded(const char *path, struct err *e, F &&f)
{
    try {
        std::string why;
        if (f(why))
            return true;
        while (!why.empty() && (why.back() == '\n' || why.back() == ' '))
            why.pop_back();
        return err_set(e, "%s: %s", path, why.empty() ? "unknown image error" : why.c_str());
    } catch (const std::exception &x) {
        return err_set(e, "%s: %s", path, x.what());
    }
}

// Which of the documented formats the file is of, by its first bytes; nullptr says why it is none.
const char *format_of(const char *path, long *size, std::string &why)
{
    struct stat st;
    std::FILE *f = std::fopen(path, "rb");
    if (f == nullptr || fstat(fileno(f), &st) != 0 || S_ISDIR(st.st_mode)) {
        why = std::string("cannot read: ") + std::strerror(f != nullptr ? EISDIR : errno);
        if (f != nullptr)
            std::fclose(f);
        return nullptr;
    }
    *size = long(st.st_size);
    unsigned char head[8] = {};
    size_t n = std::fread(head, 1, sizeof head, f);
    const char *format = nullptr;
    why = "cannot read: not an OpenEXR, Radiance, PNG or PFM file";
    if (n == 8 && std::memcmp(head, "\x76\x2f\x31\x01", 4) == 0) {
        format = "openexr";
        if (!exr_header_is_whole(f, head[4] | unsigned(head[5]) << 8, *size - 8)) {
            format = nullptr;
            why = "cannot read: the file ends within its header";
        }
    } else if (n == 8 && std::memcmp(head, "\x89PNG\r\n\x1a\n", 8) == 0) {
        format = "png";
    } else if (n >= 2 && head[0] == '#' && head[1] == '?') {
        format = "hdr";
    } else if (n >= 3 && head[0] == 'P' && std::strchr("123456Ff", head[1]) != nullptr &&
               std::isspace(head[2])) {
        format = "pnm";
    }
    std::fclose(f);
    return format;
}

// The library left to itself would try every reader that it has, for seconds and with gigabytes if the file is of none.
std::unique_ptr<OIIO::ImageInput> open_image(const char *path, std::string &why)
{
    long size;
    const char *format = format_of(path, &size, why);
    if (format == nullptr)
        return nullptr;
    OIIO::ImageSpec spec;
    auto in = OIIO::ImageInput::create(format);
    if (!in || !in->open(path, spec)) {
        why = "cannot read: " + (in ? in->geterror() : OIIO::geterror());
        return nullptr;
    }
    std::string shape = std::to_string(spec.width) + " x " + std::to_string(spec.height) + " x " +
                        std::to_string(spec.nchannels);
    if (spec.width < 1 || spec.height < 1 || spec.width > IMAGE_MAX_SIDE ||
        spec.height > IMAGE_MAX_SIDE || spec.nchannels < 1 || spec.nchannels > IMAGE_MAX_CHANNELS ||
        spec.depth > 1 || double(spec.width) * spec.height * spec.nchannels > IMAGE_MAX_FLOATS) {
        why = "an image of " + shape + " is more than this program takes";
        return nullptr;
    }
    if (double(spec.image_bytes(true)) > IMAGE_MAX_EXPANSION * double(size)) {
        why = "an image of " + shape + " cannot be in " + std::to_string(size) + " bytes";
        return nullptr;
    }
    return in;
}

} // namespace

extern "C" bool image_read(const char *path, struct image *out, bool *half, struct err *e)
{
    struct image im = {};
    bool small = false;
    bool ok = guarded(path, e, [&](std::string &why) {
        auto in = open_image(path, why);
        if (!in)
            return false;
        const OIIO::ImageSpec &spec = in->spec();
        std::vector<std::string> names(spec.channelnames);
        names.resize(size_t(spec.nchannels));
        std::vector<const char *> cnames;
        for (auto &n : names)
            cnames.push_back(n.c_str());
        for (int c = 0; c < spec.nchannels; c++)
            small = small || spec.channelformat(c).size() < 4;
        struct err inner;
        if (!image_alloc(&im, spec.width, spec.height, spec.nchannels, cnames.data(), &inner)) {
            why = inner.msg;
            return false;
        }
        if (!in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, im.data)) {
            why = "cannot read: " + in->geterror();
            return false;
        }
        for (const auto &p : spec.extra_attribs)
            if (p.type() == OIIO::TypeDesc::STRING &&
                !image_set_attr(&im, p.name().c_str(), p.get_string().c_str(), &inner)) {
                why = inner.msg;
                return false;
            }
        in->close();
        return true;
    });
    if (!ok) {
        image_free(&im);
        return false;
    }
    *out = im;
    if (half)
        *half = small;
    return true;
}

extern "C" bool image_inspect(const char *path, struct image_info *out, struct err *e)
{
    *out = {};
    return guarded(path, e, [&](std::string &why) {
        auto in = open_image(path, why);
        if (!in)
            return false;
        const OIIO::ImageSpec spec = in->spec();
        out->width = spec.width;
        out->height = spec.height;
        out->channels = spec.nchannels;
        std::snprintf(out->format, sizeof out->format, "%s", in->format_name());
        size_t smallest = 8;
        bool other = spec.deep;
        for (int c = 0; c < spec.nchannels; c++) {
            OIIO::TypeDesc type = spec.channelformat(c);
            if (type.size() < smallest) {
                smallest = type.size();
                out->type = type == OIIO::TypeDesc::UINT8    ? IMAGE_INT8
                            : type == OIIO::TypeDesc::UINT16 ? IMAGE_INT16
                            : type == OIIO::TypeDesc::HALF   ? IMAGE_HALF
                            : type == OIIO::TypeDesc::FLOAT  ? IMAGE_FLOAT
                                                             : IMAGE_OTHER;
            }
        }
        int bits = spec.get_int_attribute("oiio:BitsPerSample", int(8 * smallest));
        if (other || smallest == 8 || bits != int(8 * smallest))
            out->type = IMAGE_OTHER;
        out->orientation = spec.get_int_attribute("Orientation", 1);
        out->is_cropped = spec.x != spec.full_x || spec.y != spec.full_y ||
                          spec.width != spec.full_width || spec.height != spec.full_height;
        for (out->parts = 1; in->seek_subimage(out->parts, 0);)
            out->parts++;
        in->close();
        return true;
    });
}

extern "C" const char *image_oiio_version(void)
{
    return "OpenImageIO " OIIO_VERSION_STRING;
}
