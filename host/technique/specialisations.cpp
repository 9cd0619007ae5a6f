// Every program that can be asked for, found by walking the techniques' own keys.
#include <set>

#include "depth_image/views.hpp"
#include "technique/occluder_maps.hpp"
#include "technique/techniques.hpp"

namespace penumbra {
namespace {

// The values of a key that a program may depend on: of flags and choices all, of a number the default.
std::vector<SettingValue> values_of(const SettingKey& key, const Technique& technique)
{
    if (std::holds_alternative<Flag>(key.domain)) return {false, true};
    std::vector<SettingValue> values;
    if (const auto* choices = std::get_if<Choices>(&key.domain))
        for (const std::string_view name : choices->names) values.emplace_back(std::string(name));
    else
        values.push_back(key.get(technique));
    return values;
}

// Calls it with the technique under every combination of the values of its keys from `first` on.
void for_each_setting(const TechniqueRow& row, std::size_t first, Technique& technique, const std::function<void(const Technique&)>& call)
{
    if (first == row.keys.size()) {
        call(technique);
        return;
    }
    const SettingKey& key = row.keys[first];
    for (const SettingValue& value : values_of(key, technique)) {
        key.set(technique, value);
        for_each_setting(row, first + 1, technique, call);
    }
}

} // namespace

std::vector<opencl::Specialisation> every_specialisation()
{
    std::vector<opencl::Specialisation> all;
    std::set<std::string> known;
    const auto add = [&](const opencl::Specialisation& program) {
        if (known.insert(program.file + ' ' + program.options()).second) all.push_back(program);
    };
    add(depth_fit_program());
    for (const int lanes : {1, 8, 16}) add(depth_trace_program(lanes));
    add(receivers_program());
    add(occluders_program());
    for (const TechniqueRow& row : technique_table()) {
        Technique technique = row.defaults;
        for_each_setting(row, 0, technique, [&](const Technique& any) {
            for (const int lanes : {1, 8, 16})
                for (const auto& program : std::visit([&](const auto& s) { return specialisations(s, lanes); }, any)) add(program);
        });
    }
    return all;
}

} // namespace penumbra
