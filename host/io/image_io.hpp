// Images from bytes and to bytes; the format is decided by the first bytes, never by a name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

#include "io/depth_channel.hpp"
#include "io/raw_planes.hpp"
#include "scene/depth.hpp"

namespace penumbra {

// Largest image that is read: width * height * channels samples.
constexpr std::uint64_t max_image_samples = std::uint64_t{1} << 30;

// A whole image (1 to 4 channels; alpha kept, not multiplied in). `where` starts every message.
Image decode_image(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples = max_image_samples);

// The same, and JPEG.
Image decode_picture(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples = max_image_samples);

// One depth channel: `channel`, or the one that is depth by its name; of `part` alone, where that is given (io/depth_channel.hpp).
RawDepth decode_raw_depth(std::span<const std::byte> bytes, std::string_view channel, std::string_view where,
                          std::uint64_t max_samples = max_image_samples, const PartChoice& part = {});

// A position a pixel, x, y and z: `channel` names the layer, "P" of P.X, P.Y and P.Z.
RawPlanes decode_positions(std::span<const std::byte> bytes, std::string_view channel, std::string_view where,
                           std::uint64_t max_samples = max_image_samples, const PartChoice& part = {});

// An EXR with one float32 channel, Z.
std::vector<std::byte> encode_depth(const DepthMap& depth);

// Reads a file whole. Throws not_found or too_large.
std::vector<std::byte> read_file(const std::string& path, std::string_view where);

// Writes bytes to a temporary file beside `path`, then renames it. Throws output.
void write_file(const std::string& path, std::span<const std::byte> bytes);

} // namespace penumbra
