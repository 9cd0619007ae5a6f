// What the command line and the service both say of devices and techniques, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <penumbra/engine.hpp>

#include "technique/table.hpp"

namespace penumbra {

// Every member of DeviceInfo, then whether it is the device in use.
nlohmann::ordered_json json_of(const DeviceInfo& device, bool selected);

// A row without its keys.
nlohmann::ordered_json json_of(const TechniqueRow& row);

// What a setting may be, in the words of JSON Schema: type, minimum and maximum, enum; and what it is by default.
nlohmann::ordered_json domain_json(const SettingKey& setting);
nlohmann::ordered_json default_json(const SettingKey& setting, const TechniqueRow& row);

} // namespace penumbra
