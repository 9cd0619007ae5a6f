// What a batch is made of: scenes, the names of their outputs, and shards.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::cli {

struct BatchItem {
    std::string scene, output;        // paths
    std::vector<std::string> outputs; // of all its masks: of several lights, of a sequence; else `output` alone
};

// Part `number` of `count`, counted from 1.
struct Shard {
    std::size_t number = 1, count = 1;
};

// From "2/10"; empty is all in one. Throws usage.
Shard parse_shard(std::string_view text);

// The scenes of a folder (every *.json in it, sorted by name) or of a list (a path a line, relative to the list; # starts a comment), with
// their outputs in `folder`: the scene's stem and `format` as extension; without `format` the scene's output.format, or exr.
// Throws usage when there are none or two would write one file; not_found.
std::vector<BatchItem> batch_items(const std::string& source, const std::string& folder, const std::string& format);

// Every count-th item, starting at the shard's: neighbouring scenes, which often cost alike, spread over all shards.
std::vector<BatchItem> items_of(const Shard& shard, const std::vector<BatchItem>& items);

// The outputs are there, all of them, and not older than their scene.
bool up_to_date(const BatchItem& item);

} // namespace penumbra::cli
