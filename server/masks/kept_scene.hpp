// A scene as it was sent, kept so that light, receivers and technique can change without sending it again.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/engine.hpp>
#include <penumbra/scene_file.hpp>

#include "masks/mask_cache.hpp"
#include "masks/masks.hpp"
#include "masks/part.hpp"
#include "process/gate.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// The name of what was sent: SHA-256 of the scene's JSON and of every part.
std::string id_of(std::span<const Part> parts);

// Safe to use from several threads at once.
class KeptScene {
public:
    // Copies and decodes the parts. Throws what decoding throws.
    KeptScene(std::string id, std::span<const Part> parts, const Options& options, const Deadline& deadline);

    const std::string& id() const { return id_; }
    const std::vector<std::string>& warnings() const { return scene_.job.warnings; }
    std::uint64_t bytes() const; // all that it holds now, on the device as well
    std::uint64_t device_bytes() const { return cache_.device_bytes(); }
    void forget_results() const { cache_.clear(); }

    // Names what a task of that patch and those parts depends on, for the scene of that id.
    static std::string content_of(std::string_view id, std::string_view patch, std::span<const Part> extra);

    // What to compute a mask from: the scene with `patch` (SceneDocument::patched), an empty one to take it as it stands. The images that
    // the patch names are among `extra` and the kept parts; of one name, the extra part counts. Throws Error and Problem.
    MaskTask task(std::string_view patch, std::span<const Part> extra, const MaskChoice& choice, const Options& options,
                  const Deadline& deadline) const;

    // All lights together, in the first frame where there is a sequence: what is prepared when the scene is kept.
    const MaskChoice& first_choice() const { return scene_.first; }

private:
    // With all its lights and frames; `first`: see first_choice.
    struct Decoded {
        MaskJob job;
        OutputFormat output;
        MaskChoice first;
    };
    static Decoded decoded(std::span<const Part> parts, const Options& options, const Deadline& deadline);
    // What decides whether a kept piece still holds.
    struct Changes;
    void check_objects(const Changes& changes) const;
    std::vector<MaskLight> patched_lights(const Changes& changes, const Resources& resources, std::vector<std::string>& warnings) const;
    static void choose(const Changes& changes, const std::vector<MaskLight>& lights, bool same_occluders, const MaskChoice& choice,
                       MaskTask& task);

    const std::string id_;
    std::vector<std::pair<std::string, std::string>> owned_; // names and bytes of the parts
    std::vector<Part> parts_;                                // views of owned_
    Decoded scene_;
    SceneDocument document_;
    mutable MaskCache cache_;
};

} // namespace penumbra::server
