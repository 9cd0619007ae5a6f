// What the tests of this room share.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <penumbra/error.hpp>

#include "opencl/context.hpp"
#include "opencl/program_cache.hpp"
#include "opencl/work.hpp"

namespace penumbra::opencl::test {

// An empty folder, removed at the end.
class TemporaryFolder {
public:
    TemporaryFolder()
    {
        std::string path = (std::filesystem::temp_directory_path() / "penumbra-test-XXXXXX").string();
        if (!mkdtemp(path.data())) throw std::runtime_error("no temporary folder");
        path_ = path;
    }
    ~TemporaryFolder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::string& path() const { return path_; }

private:
    std::string path_;
};

// What `call` throws; the test fails when it throws nothing.
template <class Call> Error error_of(Call&& call)
{
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "no error was thrown";
    return Error(ErrorCode::internal, "");
}

inline bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// A context and the means to launch kernels that are not among the embedded files.
struct Device {
    std::shared_ptr<Context> context = Context::open("");
    ProgramCache programs{context->context(), context->device(), ""};

    cl::Kernel kernel(const std::string& text, const char* name)
    {
        double compile_ms = 0;
        return cl::Kernel(programs.program("test.cl", text, compile_ms), name);
    }
};

// Runs one (disabled) test of this executable in a process of its own, with these variables set; an empty value unsets. Its exit status; 0
// when it passed.
int run_in_child(const std::string& test, const std::vector<std::pair<std::string, std::string>>& environment);

} // namespace penumbra::opencl::test
