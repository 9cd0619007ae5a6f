// The report's JSON: the keys that scripts read.
#include <nlohmann/json.hpp>

#include <gtest/gtest.h>

#include <penumbra/engine.hpp>

namespace penumbra {
namespace {

std::vector<std::string> keys(const nlohmann::ordered_json& object)
{
    std::vector<std::string> names;
    for (const auto& item : object.items()) names.push_back(item.key());
    return names;
}

TEST(ReportJson, HoldsTheContractsKeysInOrder)
{
    Report report;
    report.technique = "soft_shadow_map";
    report.settings = {{"sides", std::string("both")}, {"resolution", std::int64_t{64}}, {"bias", 1.5}, {"project", false}};
    report.device_name = "a device";
    report.device_driver = "1.2";
    report.width = 7;
    report.height = 61;
    report.prepare_ms = 1;
    report.shade_ms = 2;
    report.total_ms = 4;
    report.stages = {{"shade", 2, 1.5, 1024}};
    report.peak_device_bytes = std::uint64_t{1} << 40;
    report.warnings = {"first", "second"};

    const auto json = nlohmann::ordered_json::parse(report_json(report));
    EXPECT_EQ(keys(json), (std::vector<std::string>{"technique", "settings", "device", "resolution", "prepare_ms", "shade_ms", "total_ms",
                                                    "stages", "peak_device_bytes", "warnings"}));
    EXPECT_EQ(json["technique"], "soft_shadow_map");
    EXPECT_EQ(json["settings"].dump(), R"({"sides":"both","resolution":64,"bias":1.5,"project":false})");
    EXPECT_EQ(json["device"].dump(), R"({"name":"a device","driver":"1.2"})");
    EXPECT_EQ(json["resolution"].dump(), "[7,61]");
    EXPECT_EQ(json["stages"].dump(), R"([{"name":"shade","ms":2.0,"device_ms":1.5,"bytes":1024}])");
    EXPECT_EQ(json["peak_device_bytes"], std::uint64_t{1} << 40);
    EXPECT_EQ(json["warnings"].dump(), R"(["first","second"])");
}

TEST(ReportJson, PairsAreThereWhenTheyMeanSomething)
{
    Report report;
    report.pairs = 12;
    EXPECT_EQ(nlohmann::json::parse(report_json(report)).at("pairs"), 12);
}

TEST(ReportJson, EmptyListsAndBytesThatAreNoTextStayValid)
{
    Report report;
    report.device_name = "bad \xff byte";
    const auto json = nlohmann::json::parse(report_json(report));
    EXPECT_TRUE(json.at("settings").is_object());
    EXPECT_TRUE(json.at("stages").is_array());
    EXPECT_TRUE(json.at("warnings").is_array());
    EXPECT_EQ(json.at("device").at("name"), "bad \xEF\xBF\xBD byte");
}

} // namespace
} // namespace penumbra
