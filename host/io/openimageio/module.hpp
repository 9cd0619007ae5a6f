// Images by OpenImageIO: the module's own header.
#pragma once

#include <string>

#include "io/openimageio/openimageio.hpp"

namespace penumbra {

Image decode_by_openimageio(std::span<const std::byte> bytes, ImageFormat format, std::string_view where, std::uint64_t max_samples);
RawPlanes decode_planes_by_openimageio(std::span<const std::byte> bytes, ImageFormat format, const PlaneRequest& request, std::string_view where,
                                       std::uint64_t max_samples);
std::vector<std::byte> encode_by_openimageio(const Image& image, ImageFormat format, int bits);

// OpenImageIO's name for the reader and writer of a format.
std::string plugin(ImageFormat format);

// Settings that OpenImageIO keeps for the whole process: one thread, no other reader than the one asked for. Set on first use.
void configure_openimageio();

} // namespace penumbra
