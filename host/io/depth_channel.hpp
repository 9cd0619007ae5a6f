// Which channels of an image file are depth, or positions: by their names alone.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace penumbra {

// The part of an EXR or the directory of a TIFF: by number, from 0, or by name. Neither: whichever has what is looked for.
using PartChoice = std::variant<std::monostate, int, std::string>;

// One depth channel, or the three of a position.
enum class Planes { depth, position };

struct PlaneRequest {
    Planes planes = Planes::depth;
    std::string channel = {}; // empty: found by itself. Of positions the layer, "P" of P.X, P.Y, P.Z
    PartChoice part = {};
};

// What a part of a file says about itself.
struct ImagePart {
    std::string name; // may be empty
    std::vector<std::string> channels;
    bool deep = false;
};

struct PlanePick {
    int part = 0;
    std::vector<int> channels; // one; or x, y, z
};

// Depth is Z, depth or ZDepth without a layer; a layer (or part) of such a name or one that ends in it, such as ViewLayer.Depth.Z, depth.Z,
// Depth.V, ZDepth.R and WorldDepth.R; or the file's only channel beside alpha. Another Z (of normals, positions, vectors, mist) is none.
// Positions are the X, Y, Z or R, G, B of a layer P, Position, WorldPosition, or the file's only three channels. Throws invalid_input that
// lists what there is, when nothing or more than one fits.
PlanePick pick_planes(std::span<const ImagePart> parts, const PlaneRequest& request, std::string_view where);

// "R, G, B, A": for messages, of a length that fits into them.
std::string channel_list(std::span<const ImagePart> parts);

// Text of a file for a message: one line of plain characters, not too long.
std::string plain_line(std::string text);

} // namespace penumbra
