// Where the names of a request's scene lead: to parts of that request, and nowhere else.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <penumbra/error.hpp>
#include <penumbra/scene_file.hpp>

#include "masks/part.hpp"
#include "process/gate.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// Used by one thread. Parts, options and deadline outlive it.
class RequestResources final : public Resources {
public:
    RequestResources(std::span<const Part> parts, const Options& options, const Deadline& deadline)
        : parts_(parts), options_(options), deadline_(deadline)
    {
    }
    ~RequestResources() override;

    // Throws not_found (listing the parts), unsupported for anything but EXR, PNG, TIFF and PFM, too_large when the scene names more
    // than options.parts of them, each counted as often as it is named; Problem 504 when the deadline has passed.
    Bytes bytes(const std::string& name) const override;
    // A mesh, in a private temporary file that goes with this object. Throws unsupported without options.allow_meshes.
    std::string path(const std::string& name) const override;
    std::uint64_t max_samples() const override { return static_cast<std::uint64_t>(options_.image_samples); }

private:
    std::string_view use(const std::string& name) const;

    std::span<const Part> parts_;
    const Options& options_;
    const Deadline& deadline_;
    mutable std::int64_t uses_ = 0;
    mutable std::filesystem::path folder_;
};

} // namespace penumbra::server
