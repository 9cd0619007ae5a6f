// A request's form. Input: the value of Content-Type, a line feed, the body.
#include <algorithm>
#include <vector>

#include "fuzz/target.hpp"
#include "masks/multipart.hpp"
#include "process/problem.hpp"

using namespace penumbra::server;
using penumbra::fuzz::expect;

namespace {

constexpr std::size_t max_parts = 8;

void expect_problem(const Problem& problem)
{
    expect(problem.status == 400 || problem.status == 413 || problem.status == 415, "status " + std::to_string(problem.status));
    expect(!problem.reason.empty(), "a problem without a reason");
    penumbra::fuzz::expect_message(problem.detail);
    expect(nlohmann::json::parse(json_of(problem, "id")).at("detail") == problem.detail, "a problem that its JSON changes");
}

std::string form_of(const std::vector<Part>& parts, const std::string& boundary)
{
    std::string form;
    for (const Part& part : parts)
        form +=
            "--" + boundary + "\r\nContent-Disposition: form-data; name=\"" + part.name + "\"\r\n\r\n" + std::string(part.bytes) + "\r\n";
    return form + "--" + boundary + "--\r\n";
}

void check_parts(const std::vector<Part>& parts, std::string_view body, const std::string& boundary)
{
    expect(parts.size() <= max_parts, "more parts than allowed");
    const char* end = body.data();
    for (const Part& part : parts) {
        expect(is_part_name(part.name), "a part has the name " + part.name);
        expect(std::ranges::count(parts, part.name, &Part::name) == 1, "two parts of one name");
        // One after another, inside the body.
        expect(part.bytes.data() >= end && part.bytes.data() + part.bytes.size() <= body.data() + body.size(), "a part lies elsewhere");
        end = part.bytes.data() + part.bytes.size();
        expect(part.bytes.find("\r\n--" + boundary) == std::string_view::npos, "a part holds a delimiter");
    }

    // Written as a form they are the same parts. (A body without parts is one that no form of ours has: it begins with its end.)
    const std::string form = form_of(parts, boundary);
    const std::vector<Part> again = parse_multipart(form, boundary, max_parts);
    expect(again.size() == parts.size(), "another number of parts the second time");
    for (std::size_t i = 0; i < parts.size(); ++i)
        expect(again[i].name == parts[i].name && again[i].bytes == parts[i].bytes, "another part the second time: " + parts[i].name);
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view text = penumbra::fuzz::text_of(data, size);
    const std::size_t line = text.find('\n');
    if (line == std::string_view::npos) return 0;
    const std::string_view content_type = text.substr(0, line), body = text.substr(line + 1);
    try {
        (void)is_json(content_type);
        const std::string boundary = boundary_of(content_type);
        check_parts(parse_multipart(body, boundary, max_parts), body, boundary);
    } catch (const Problem& problem) {
        expect_problem(problem);
    }
    return 0;
}
