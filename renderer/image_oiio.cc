// The one C++ file: image.h over OpenImageIO. Exceptions end here, as text in struct err.
extern "C" {
#include "image.h"
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

// 16384 x 16384 pixels of a dozen channels; a header that asks for more is refused unread.
constexpr int max_side = 1 << 16;
constexpr double max_floats = 4e9;

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

// Writes beside `path` and renames, so that a reader never sees half a file.
template <typename F> bool by_rename(const char *path, struct err *e, F &&write)
{
    std::string temp = std::string(path) + ".tmp" + std::to_string(getpid());
    bool ok = guarded(path, e, [&](std::string &why) { return write(temp, why); });
    if (ok && std::rename(temp.c_str(), path) != 0)
        ok = err_set(e, "%s: cannot write: %s", path, std::strerror(errno));
    if (!ok)
        unlink(temp.c_str());
    return ok;
}

bool write_png_to(OIIO::ImageOutput &out, const std::string &name, int width, int height,
                  const uint8_t *rgb8, std::string &why)
{
    OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    if (!out.open(name, spec) || !out.write_image(OIIO::TypeDesc::UINT8, rgb8) || !out.close()) {
        why = "cannot write: " + out.geterror();
        return false;
    }
    return true;
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
        if (spec.width < 1 || spec.height < 1 || spec.width > max_side || spec.height > max_side ||
            spec.nchannels < 1 || spec.nchannels > 4096 || spec.depth > 1 ||
            double(spec.width) * spec.height * spec.nchannels > max_floats) {
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

extern "C" bool image_write_exr(const char *path, const struct image *im, struct err *e)
{
    return by_rename(path, e, [&](const std::string &temp, std::string &why) {
        auto out = OIIO::ImageOutput::create("exr");
        if (!out) {
            why = "cannot write: " + OIIO::geterror();
            return false;
        }
        OIIO::ImageSpec spec(im->width, im->height, im->channels, OIIO::TypeDesc::FLOAT);
        for (int c = 0; c < im->channels; c++)
            spec.channelnames[size_t(c)] = im->names[c];
        spec.attribute("compression", "zip");
        /* Else the time of writing goes in, and the same picture has other bytes each time. */
        spec.attribute("DateTime", "");
        for (int i = 0; i < im->num_attrs; i++)
            spec.attribute(im->attr[2 * i], im->attr[2 * i + 1]);
        if (!out->open(temp, spec) || !out->write_image(OIIO::TypeDesc::FLOAT, im->data) ||
            !out->close()) {
            why = "cannot write: " + out->geterror();
            return false;
        }
        return true;
    });
}

extern "C" bool image_write_png(const char *path, int width, int height, const uint8_t *rgb8,
                                struct err *e)
{
    return by_rename(path, e, [&](const std::string &temp, std::string &why) {
        auto out = OIIO::ImageOutput::create("png");
        return write_png_to(*out, temp, width, height, rgb8, why);
    });
}

extern "C" bool image_encode_png(int width, int height, const uint8_t *rgb8, uint8_t **bytes,
                                 size_t *size, struct err *e)
{
    return guarded("PNG in memory", e, [&](std::string &why) {
        std::vector<unsigned char> buffer;
        OIIO::Filesystem::IOVecOutput io(buffer);
        auto out = OIIO::ImageOutput::create("memory.png", &io);
        if (!out) {
            why = OIIO::geterror();
            return false;
        }
        if (!write_png_to(*out, "memory.png", width, height, rgb8, why))
            return false;
        *bytes = static_cast<uint8_t *>(std::malloc(buffer.size()));
        if (*bytes == nullptr) {
            why = "out of memory";
            return false;
        }
        std::memcpy(*bytes, buffer.data(), buffer.size());
        *size = buffer.size();
        return true;
    });
}

extern "C" const char *image_library_version(void)
{
    return "OpenImageIO " OIIO_VERSION_STRING;
}
