// Files under the names that they have in a request.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <penumbra/client/images.hpp>

namespace penumbra::client::detail {

class Parts {
public:
    // The part that holds a file: its last name; of two files that would get one name, the second becomes name-2.exr. Throws
    // std::system_error naming the file.
    const std::string& part_of(const std::filesystem::path& file)
    {
        std::error_code ignored;
        std::string& name = names_[std::filesystem::weakly_canonical(file, ignored).string()];
        if (name.empty()) {
            std::string bytes = file_bytes(file);
            name = free_name(file);
            images_.emplace(name, std::move(bytes));
        }
        return name;
    }
    // The same; nothing for a file that cannot be read or has nothing in it, which is no part.
    std::optional<std::string> find(const std::filesystem::path& file)
    {
        std::error_code error;
        if (!std::filesystem::is_regular_file(file, error) || std::filesystem::file_size(file, error) == 0 || error) return {};
        try {
            return part_of(file);
        } catch (const std::system_error&) {
            return {};
        }
    }
    // No part gets this name from now on. False: one has it.
    bool keep_free(const std::string& name)
    {
        kept_free_.insert(name);
        return !images_.contains(name);
    }
    std::string_view bytes(const std::string& part) const { return images_.at(part); }
    Images take() { return std::move(images_); }

private:
    // The file's own name, with what the service does not allow replaced by _. At most 120 characters, so that a number still fits into the
    // 128 that the service allows; the end stays, as it decides a mesh's format.
    std::string free_name(const std::filesystem::path& file) const
    {
        std::string base = file.filename().string();
        for (char& c : base)
            if (!is_part_name(std::string("a") + c)) c = '_';
        if (base.size() > 120) base.erase(0, base.size() - 120);
        base.erase(0, base.find_first_not_of('.'));
        if (base.empty()) base = "image";
        const std::filesystem::path name(base);
        for (int number = 2; images_.contains(base) || kept_free_.contains(base) || base == "scene"; ++number)
            base = name.stem().string() + "-" + std::to_string(number) + name.extension().string();
        return base;
    }

    Images images_;
    std::map<std::string, std::string> names_; // by the file's real path
    std::set<std::string> kept_free_;
};

} // namespace penumbra::client::detail
