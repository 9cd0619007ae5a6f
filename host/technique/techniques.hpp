// Every technique with its verbs: what walks over all of them includes this and asks no technique for its name.
#pragma once

#include <type_traits>
#include <variant>

#include "technique/depth_trace.hpp"
#include "technique/occlusion_texture.hpp"
#include "technique/ray_traced.hpp"
#include "technique/shadow_map.hpp"
#include "technique/smoothie.hpp"
#include "technique/soft_shadow_map.hpp"
#include "technique/soft_shadow_volume.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

// A technique that lacks a verb stops the build here.
template <class S>
concept HasVerbs = requires(const S& settings, opencl::Work& work, const Casting& casting, Findings& findings, const Receiving& receivers,
                            Shaded& shaded, const MaskShape& shape)
{
    {
        row(settings)
        } -> std::same_as<TechniqueRow>;
    {
        needs(settings)
        } -> std::same_as<Needs>;
    {
        shade(work, prepare(work, casting, settings, findings), receivers, shaded)
        } -> std::same_as<void>;
    {
        penumbra::work(settings, shape)
        } -> std::same_as<std::vector<WorkAmount>>;
    {
        specialisations(settings, 16)
        } -> std::same_as<std::vector<opencl::Specialisation>>;
    {
        device_buffers(settings)
        } -> std::same_as<DeviceBuffers>;
};

template <class S> struct PreparedBy {
    static_assert(HasVerbs<S>, "a technique lacks one of the verbs of technique/verbs.hpp");
    using type = decltype(prepare(std::declval<opencl::Work&>(), std::declval<const Casting&>(), std::declval<const S&>(),
                                  std::declval<Findings&>()));
};

template <class Settings> struct PreparedVariant;
template <class... S> struct PreparedVariant<std::variant<S...>> {
    using type = std::variant<typename PreparedBy<S>::type...>;
};

// What any technique's prepare made.
using PreparedTechnique = PreparedVariant<Technique>::type;

inline Needs needs_of(const Technique& technique)
{
    return std::visit(
        [](const auto& settings) {
            Needs wanted = needs(settings);
            wanted.tolerance = wanted.every_receiver ? 0 : settings.tolerance;
            return wanted;
        },
        technique);
}

// Throws invalid_input for keys that exclude each other.
inline void check_together_of(const Technique& technique)
{
    std::visit(
        [](const auto& settings) {
            if constexpr (requires { check_together(settings); }) check_together(settings);
        },
        technique);
}

inline DeviceBuffers device_buffers_of(const Technique& technique)
{
    return std::visit([](const auto& settings) { return device_buffers(settings); }, technique);
}

// What the kernels are built with on some device: every technique with every combination of its flags and choices, and the programs that
// are launched where no technique is at work. The build compiles each.
std::vector<opencl::Specialisation> every_specialisation();

} // namespace penumbra
