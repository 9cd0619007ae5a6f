// A scene as it was sent, kept so that light, receivers and technique can change without sending it again.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/engine.hpp>

#include "io/json_value.hpp"
#include "io/scene_file.hpp"
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
    const std::vector<std::string>& warnings() const { return scene_.warnings; }
    std::uint64_t bytes() const; // all that it holds now, on the device as well
    std::uint64_t device_bytes() const { return cache_.device_bytes(); }
    void forget_results() const { cache_.clear(); }

    // Names what a task of that patch and those parts depends on.
    std::string content_of(std::string_view patch, std::span<const Part> extra) const;

    // What to compute a mask from: the scene with `patch` (scene_patch.hpp), an empty one to take it as it stands. The images that the
    // patch names are among `extra` and the kept parts; of one name, the extra part counts. Throws Error and Problem.
    MaskTask task(std::string_view patch, std::span<const Part> extra, const MaskChoice& choice, const Options& options,
                  const Deadline& deadline) const;

    // All lights together, in the first frame where there is a sequence: what is prepared when the scene is kept.
    const MaskChoice& first_choice() const { return first_choice_; }

private:
    // What decides whether a kept piece still holds.
    struct Changes;
    // The scene's only light, or those of its list; and the occluders of those that have none of their own.
    struct Lights {
        struct One {
            std::string name; // empty: the only one
            double weight = 1;
            Light light;
            std::shared_ptr<const Occluders> own; // may be null
        };
        std::vector<One> list;
        std::shared_ptr<const Occluders> shared;
    };
    static std::shared_ptr<const Lights> lights_of(Scene& scene);
    void check_objects(const Changes& changes) const;
    std::shared_ptr<const Lights> patched_lights(const Changes& changes, const JsonObject& root, const Resources& resources,
                                                 std::vector<std::string>& warnings) const;
    static std::vector<TaskLight> chosen(const Changes& changes, const Lights& lights, bool same_occluders, const MaskChoice& choice);

    const std::string id_;
    std::vector<std::pair<std::string, std::string>> owned_; // names and bytes of the parts
    std::vector<Part> parts_;                                // views of owned_
    nlohmann::json document_;
    Scene scene_; // decoded; without what the pointers below hold
    MaskChoice first_choice_;
    std::shared_ptr<const Lights> lights_;
    std::shared_ptr<const Receivers> receivers_;
    Geometry geometry_;
    mutable MaskCache cache_;
};

} // namespace penumbra::server
