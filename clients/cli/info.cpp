// penumbra info: devices, limits, versions, and what the environment sets.
#include <array>
#include <cstdlib>
#include <iomanip>
#include <memory>
#include <optional>
#include <sstream>

#include <nlohmann/json.hpp>

#include <penumbra/describe.hpp>
#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>

#include "engine/report.hpp"
#include "opencl/cache_folder.hpp"
#include "scene/parallel.hpp"
#include "streams.hpp"
#include "technique_flags.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Flags {
    std::string device;
    bool json = false;
};

// Every environment variable that changes what the program does.
struct Variable {
    const char *name, *meaning;
};
constexpr std::array variables{
    Variable{"PENUMBRA_DEVICE", "the device when --device is not given: an index or a part of its name"},
    Variable{"PENUMBRA_CACHE_DIR", "where built kernels are kept (default: $XDG_CACHE_HOME/penumbra or ~/.cache/penumbra)"},
    Variable{"PENUMBRA_THREADS", "threads for rendering depth and ray tracing, 1 to 1024 (default: the processors of this process)"},
    Variable{"POCL_MAX_PTHREAD_COUNT", "threads of a PoCL device (default: the processors of this process)"},
    Variable{"POCL_CACHE_DIR", "where PoCL keeps its own compiled kernels (default: beside ours)"},
    Variable{"OCL_ICD_VENDORS", "where the OpenCL loader looks for platforms (default: /etc/OpenCL/vendors)"},
};

struct Found {
    std::vector<DeviceInfo> devices;
    std::optional<int> selected; // index
    std::optional<Error> error;  // why no device is usable
    std::vector<std::string> warnings;
};

Found find(const std::string& selector)
{
    Found found;
    try {
        found.devices = list_devices();
        const DeviceInfo chosen = open_engine(selector).device();
        found.selected = chosen.index;
        found.warnings = environment_warnings(chosen);
        if (!selector.empty()) found.devices = {chosen};
    } catch (const Error& error) {
        found.error = error;
    }
    return found;
}

Json technique_json(const TechniqueRow& row)
{
    Json keys = Json::array();
    for (const SettingKey& setting : row.keys) {
        Json key = {{"name", setting.name}};
        key.update(domain_json(setting));
        if (!setting.unit.empty()) key["unit"] = setting.unit;
        key["default"] = default_json(setting, row);
        key["meaning"] = setting.meaning;
        keys.push_back(key);
    }
    Json technique = json_of(row);
    technique["keys"] = keys;
    return technique;
}

std::string compiler()
{
#ifdef __clang__
    return __VERSION__;
#else
    return "GCC " __VERSION__;
#endif
}

std::string json_text(const Found& found, const Json& environment)
{
    Json devices = Json::array(), techniques = Json::array();
    for (const DeviceInfo& device : found.devices) devices.push_back(json_of(device, device.index == found.selected));
    for (const TechniqueRow& row : technique_table()) techniques.push_back(technique_json(row));
    const Json json = {{"version", version()},
                       {"build", {{"type", PENUMBRA_BUILD_TYPE}, {"compiler", compiler()}}},
                       {"devices", devices},
                       {"threads", thread_count()},
                       {"cache_folder", opencl::cache_folder()},
                       {"environment", environment},
                       {"techniques", techniques}};
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string mebibytes(std::uint64_t bytes)
{
    std::ostringstream out;
    if (bytes < 1024 * 1024)
        out << static_cast<double>(bytes) / 1024 << " KiB";
    else
        out << std::fixed << std::setprecision(0) << static_cast<double>(bytes) / (1024 * 1024) << " MiB";
    return out.str();
}

std::string text_of(const DeviceInfo& device, bool selected)
{
    std::ostringstream out;
    out << "  [" << device.index << "] " << device.name << (selected ? "  (selected)" : "") << "\n"
        << "      " << device.type << ", " << device.vendor << "\n      platform " << device.platform << "\n"
        << "      " << device.version << ", driver " << device.driver << "\n"
        << "      " << device.compute_units << " compute units, " << device.lanes << " receivers a work-item, work-groups of up to "
        << device.max_work_group << "\n"
        << "      memory " << mebibytes(device.global_bytes) << ", largest buffer " << mebibytes(device.max_allocation_bytes) << ", local "
        << mebibytes(device.local_bytes) << "\n";
    return out.str();
}

std::string people_text(const Found& found, const Json& environment)
{
    const std::string cache = opencl::cache_folder();
    std::ostringstream out;
    out << "penumbra " << version() << " (" << PENUMBRA_BUILD_TYPE << ", " << compiler() << ")\n\nDevices\n";
    for (const DeviceInfo& device : found.devices) out << text_of(device, device.index == found.selected);
    if (found.devices.empty()) out << "  none\n";
    out << "\nThreads  " << thread_count() << "\nCache    " << (cache.empty() ? "none: built kernels are not kept" : cache)
        << "\n\nEnvironment\n";
    for (const Variable& variable : variables) {
        const Json& value = environment[variable.name];
        out << "  " << std::left << std::setw(24) << variable.name << (value.is_null() ? "not set" : value.get<std::string>()) << "\n      "
            << variable.meaning << "\n";
    }
    out << "\n" << technique_help();
    return out.str();
}

int run(const Flags& flags)
{
    // Read before the first OpenCL call, which sets some of them for this process.
    Json environment = Json::object();
    for (const Variable& variable : variables) {
        const char* value = std::getenv(variable.name);
        environment[variable.name] = value ? Json(value) : Json(nullptr);
    }

    const Found found = find(flags.device);
    print(flags.json ? json_text(found, environment) : people_text(found, environment));
    print_warnings(found.warnings);
    if (found.error) throw *found.error;
    return 0;
}

} // namespace

Verb info_verb(CLI::App& program)
{
    const auto flags = std::make_shared<Flags>();
    CLI::App* app = add_verb(program, "info", "Show devices, limits, versions and techniques.", "info [--json] [--device SELECTOR]");
    app->add_flag("--json", flags->json, "the same as JSON");
    add_device_flag(*app, flags->device);
    app->footer("Without a usable device everything else is shown, and the exit code is 1.");
    return {app, [flags] { return run(*flags); }};
}

} // namespace penumbra::cli
