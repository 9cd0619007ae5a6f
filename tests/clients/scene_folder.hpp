// Scene files and what they name, in a folder that is gone afterwards.
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <stdlib.h>

namespace penumbra::test {

class SceneFolder : public ::testing::Test {
protected:
    SceneFolder()
    {
        std::string name = (std::filesystem::temp_directory_path() / "penumbra_client_XXXXXX").string();
        if (!::mkdtemp(name.data())) throw std::runtime_error("mkdtemp");
        folder = name;
    }
    ~SceneFolder() override { std::filesystem::remove_all(folder); }
    std::filesystem::path write(const std::string& name, const std::string& text) const
    {
        std::filesystem::create_directories((folder / name).parent_path());
        std::ofstream(folder / name, std::ios::binary) << text;
        return folder / name;
    }
    std::filesystem::path folder;
};

} // namespace penumbra::test
