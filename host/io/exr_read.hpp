// EXR pixels of the kind that renderers write, through OpenEXRCore, on every core. OpenImageIO would have to be loaded first
// (openimageio/openimageio.hpp), and reads them on one thread.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <penumbra/image.hpp>

#include "scene/depth.hpp"

struct _priv_exr_context_t;

namespace penumbra {

struct ExrChannel {
    std::string name;
    SampleType type = SampleType::float32; // uint32, float16 or float32
};

// One part of scanlines, uncompressed or ZIP, without subsampling, not turned.
class PlainExr {
public:
    // Nothing for another kind of EXR, and for one that is not sound: OpenImageIO says best what is wrong with it. The bytes must stay, and
    // have passed check_exr_header.
    static std::optional<PlainExr> open(std::span<const std::byte> exr);

    int width() const { return width_; }
    int height() const { return height_; }
    const ImageFrame& frame() const { return frame_; } // the display window, in the samples' pixels
    bool whole() const; // nothing is cropped, nothing is beyond the display window
    double pixel_aspect() const { return pixel_aspect_; }
    const std::vector<ExrChannel>& channels() const { return channels_; } // by name

    // The samples of some channels, interleaved, row 0 at the top; integers as stored. Nothing for a file that is broken. What is read here
    // is what OpenImageIO reads, bit for bit.
    std::optional<std::vector<float>> read(std::span<const std::size_t> picked) const;

private:
    struct Finish {
        void operator()(_priv_exr_context_t* context) const;
    };
    struct Source; // the file's bytes, for OpenEXRCore's callbacks

    std::shared_ptr<Source> source_;
    std::unique_ptr<_priv_exr_context_t, Finish> context_;
    int width_ = 0, height_ = 0, first_row_ = 0;
    ImageFrame frame_;
    double pixel_aspect_ = 1;
    std::vector<ExrChannel> channels_;
};

} // namespace penumbra
