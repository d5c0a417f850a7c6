// The one C++ file: image_oiio.h. Exceptions end here, as text in struct err.
extern "C" {
#include "image_oiio.h"
}

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
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
        for (char &c : why)
            if (c == '\n')
                c = ' ';
        return err_set(e, "%s: %s", path, why.empty() ? "unknown image error" : why.c_str());
    } catch (const std::exception &x) {
        return err_set(e, "%s: %s", path, x.what());
    }
}

} // namespace

extern "C" bool image_read(const char *path, struct image *out, bool *half, struct err *e)
{
    struct image im = {};
    bool small = false;
    bool ok = guarded(path, e, [&](std::string &why) {
        if (access(path, R_OK) != 0) {
            why = std::string("cannot read: ") + std::strerror(errno);
            return false;
        }
        auto in = OIIO::ImageInput::open(path);
        if (!in) {
            why = "cannot read: " + OIIO::geterror();
            return false;
        }
        const OIIO::ImageSpec &spec = in->spec();
        if (spec.width < 1 || spec.height < 1 || spec.width > IMAGE_MAX_SIDE ||
            spec.height > IMAGE_MAX_SIDE || spec.nchannels < 1 ||
            spec.nchannels > IMAGE_MAX_CHANNELS || spec.depth > 1 ||
            double(spec.width) * spec.height * spec.nchannels > IMAGE_MAX_FLOATS) {
            why = "an image of " + std::to_string(spec.width) + " x " +
                  std::to_string(spec.height) + " x " + std::to_string(spec.nchannels) +
                  " is more than this program takes";
            return false;
        }
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
        if (access(path, R_OK) != 0) {
            why = std::string("cannot read: ") + std::strerror(errno);
            return false;
        }
        auto in = OIIO::ImageInput::open(path);
        if (!in) {
            why = "cannot read: " + OIIO::geterror();
            return false;
        }
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
