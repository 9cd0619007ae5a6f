// What a Prepared holds, and what a report is made from.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <penumbra/engine.hpp>

#include "opencl/work.hpp"
#include "refine/occluder_field.hpp"
#include "scene/ground.hpp"
#include "technique/techniques.hpp"

namespace penumbra {

// Wall time since it was made.
class Stopwatch {
public:
    double ms() const { return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count(); }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

struct Prepared::State {
    std::shared_ptr<const opencl::LateContext> device;
    Technique technique;
    Light light;
    Camera light_view;                             // that receivers come in; unused by rays
    int channels = 1;                              // of the visibility
    bool covered = false;                          // every caster is known to lie inside the occluder map
    std::vector<Ground> grounds;                   // that the occluder map was not fitted to, as nothing receives behind them
    std::optional<Geometry> receiver_geometry;     // with objects that receive, where the technique wants the light's view of them
    PreparedTechnique data;
    std::shared_ptr<const OccluderField> field;    // with a tolerance: what casts, so that fewer receivers are shaded; null: all are
    bool proves_lit = false;                       // the field is of all that darkens but the receivers' own horizons

    std::vector<Stage> stages;
    double prepare_ms = 0;
    std::shared_ptr<opencl::MemoryMeter> memory; // of what is kept on the device
    std::shared_ptr<opencl::MemoryMeter> shared; // of what it has from the state that it was made from; may be null
    std::uint64_t peak_bytes = 0;                // while preparing
    std::vector<std::string> warnings;
    std::vector<std::string> notes; // for the report
};

// Throws unsupported when the technique does not take this light.
void check_light(const Light& light, const Technique& technique);

// Engine::shade; `estimated`: MaskHooks::estimated.
Mask shade_estimated(const Prepared& prepared, const Receivers& receivers, bool bound, const std::function<void(const WorkAmount&)>& estimated);

// Some pixels of what Engine::shade gives (y width + x), each by itself: no tolerance leaves one to its neighbours.
std::vector<float> shade_pixels(const Prepared& prepared, const Receivers& receivers, std::span<const std::uint32_t> pixels);

// Throws unsupported for a technique that has no bounds.
void require_bounds(const Technique& technique);

// The time of all stages but compiling and rendering depth.
double work_ms(const std::vector<Stage>& stages);

// Adds the report of one light to that of all together: its work, and its warnings under its name. `common` are warnings of the scene,
// which stand in front of those of each light.
void add_report(Report& all, const Report& one, const std::string& name, const std::vector<std::string>& common);

// Appends stages, joining those of the same name.
void add_stages(std::vector<Stage>& all, const std::vector<Stage>& more);

} // namespace penumbra
