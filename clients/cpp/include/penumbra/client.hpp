// A client of the penumbra service in one header. It needs cpp-httplib and nlohmann-json, not the penumbra library.
//
//     penumbra::client::Client service("http://127.0.0.1:8080");
//     auto [scene, images] = penumbra::client::load_scene_file("scene.json");
//     images["front.pfm"] = penumbra::client::pfm_bytes(front);             // a penumbra::Image instead of a file
//     penumbra::client::Mask mask = service.mask(scene, images);
//     mask.visibility.at(x, y);                                             // 1 fully lit, 0 umbra
//
//     auto kept = service.keep(scene, images);                              // uploaded once
//     for (double half : {0.1, 0.2, 0.5}) kept.mask({{"light", {{"half_u", {half, 0, 0}}, {"half_v", {0, 0, -half}}}}});
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <penumbra/client/errors.hpp>
#include <penumbra/client/images.hpp>
#include <penumbra/client/scene_file.hpp>
#include <penumbra/client/transport.hpp>

namespace penumbra::client {

enum class Format { pfm, exr, png, tiff };

// The mask itself, or the lowest and the highest visibility that each pixel can have where depth images cast: two channels, low and high,
// for which the format has to be exr.
enum class MaskImage { mask, bound };

struct Mask {
    Image visibility;  // where the format is pfm: linear, 1 fully lit, 0 umbra; 1 channel, 3 under a textured light
    std::string bytes; // the file as the service sent it: of the mask, or of its bound
    Format format = Format::pfm;
    std::vector<std::string> warnings;                     // what the service assumed or left out
    std::vector<std::pair<std::string, double>> stages_ms; // in the order they ran
    std::string request_id;                                // in the service's log
    std::string etag;                                      // of inputs, format, program and device: see MaskOptions::previous
};

struct MaskOptions {
    Format format = Format::pfm;
    const Mask* previous = nullptr; // a mask from before: copied when the service says that the answer would be the same
    std::string light = {};         // of a scene with `lights`, the name of one; empty: all together
    int frame = 0;                  // of a scene with a sequence, its number from 1; 0: there is none
    MaskImage image = MaskImage::mask;
};

namespace detail {

inline std::string media_type(Format format)
{
    switch (format) {
    case Format::exr:
        return "image/x-exr";
    case Format::png:
        return "image/png";
    case Format::tiff:
        return "image/tiff";
    case Format::pfm:
        break;
    }
    return "image/x-portable-floatmap";
}

inline std::string trimmed(std::string_view text)
{
    const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
    return std::string(text.substr(begin, text.find_last_not_of(" \t") + 1 - begin));
}

inline std::vector<std::string> split(const std::string& text, char separator)
{
    std::vector<std::string> pieces;
    std::istringstream in(text);
    for (std::string piece; std::getline(in, piece, separator);) pieces.push_back(trimmed(piece));
    return pieces;
}

// Stages of a Server-Timing header that have a duration; others (a proxy may add its own) are not the service's.
inline std::vector<std::pair<std::string, double>> stages_from(const std::string& header)
{
    std::vector<std::pair<std::string, double>> stages;
    for (const std::string& entry : split(header, ',')) {
        const std::vector<std::string> pieces = split(entry, ';');
        for (std::size_t i = 1; i < pieces.size(); ++i)
            if (double ms = 0; pieces[i].starts_with("dur=") && parse(std::string_view(pieces[i]).substr(4), ms))
                stages.emplace_back(pieces[0], ms);
    }
    return stages;
}

inline std::vector<std::string> warnings_from(const httplib::Response& answer)
{
    const std::string header = answer.get_header_value("Penumbra-Warnings");
    if (header.empty()) return {};
    const nlohmann::json json = nlohmann::json::parse(header, nullptr, false);
    if (!json.is_array() || !std::ranges::all_of(json, [](const auto& warning) { return warning.is_string(); }))
        broken(answer, "Penumbra-Warnings is not a JSON array of strings");
    return json.get<std::vector<std::string>>();
}

inline Mask mask_from(httplib::Response answer, Format format)
{
    const std::string type = answer.get_header_value("Content-Type");
    if (trimmed(type.substr(0, type.find(';'))) != media_type(format))
        broken(answer, "it is " + (type.empty() ? "of no type" : type) + ", expected " + media_type(format));
    Mask mask;
    mask.format = format;
    mask.warnings = warnings_from(answer);
    mask.stages_ms = stages_from(answer.get_header_value("Server-Timing"));
    mask.request_id = answer.get_header_value("X-Request-Id");
    mask.etag = answer.get_header_value("ETag");
    if (format == Format::pfm) {
        auto image = image_from_pfm(answer.body);
        if (!image) broken(answer, "the mask is not a whole portable float map");
        mask.visibility = std::move(*image);
    }
    mask.bytes = std::move(answer.body);
    return mask;
}

inline nlohmann::json json_from(const httplib::Response& answer)
{
    nlohmann::json json = nlohmann::json::parse(answer.body, nullptr, false);
    if (!json.is_object()) broken(answer, "expected a JSON object");
    return json;
}

// "?light=NAME&frame=N&image=bound", of what is asked for.
inline std::string query_of(const MaskOptions& options)
{
    const auto fits = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    };
    if (!std::ranges::all_of(options.light, fits)) throw std::invalid_argument("light: expected a name of A-Z a-z 0-9 _ -");
    if (options.frame < 0) throw std::invalid_argument("frame: is " + std::to_string(options.frame) + ", expected 1 or more");
    if (options.image == MaskImage::bound && options.format != Format::exr)
        throw std::invalid_argument("image: bound has two named channels, expected format exr");
    std::string query = options.light.empty() ? std::string() : "?light=" + options.light;
    if (options.frame > 0) query += (query.empty() ? "?frame=" : "&frame=") + std::to_string(options.frame);
    if (options.image == MaskImage::bound) query += query.empty() ? "?image=bound" : "&image=bound";
    return query;
}

inline Mask ask_mask(const Transport& transport, const std::string& base, const Body& body, const MaskOptions& options)
{
    const std::string path = base + query_of(options);
    httplib::Headers headers{{"Accept", media_type(options.format)}};
    const bool conditional = options.previous && !options.previous->etag.empty() && options.previous->format == options.format;
    if (!conditional) return mask_from(transport.ask("POST", path, &body, headers, {200}), options.format);
    headers.emplace("If-None-Match", options.previous->etag);
    httplib::Response answer = transport.ask("POST", path, &body, headers, {200, 304});
    return answer.status == 304 ? *options.previous : mask_from(std::move(answer), options.format);
}

} // namespace detail

// A scene that the service keeps for a time, renewed by each use. When it was forgotten it is uploaded again by itself.
class KeptScene {
public:
    // The mask of the kept scene with `patch` merged into it for this request only (JSON Merge Patch, RFC 7396: the sections light, lights,
    // receivers, technique, output; one with another kind replaces the kept one). `images` add to the kept ones or replace them.
    Mask mask(const nlohmann::json& patch = nlohmann::json::object(), const Images& images = {}, const MaskOptions& options = {})
    {
        const detail::Body body =
            images.empty() ? detail::Body{patch.dump(), "application/merge-patch+json"} : detail::form(patch.dump(), images);
        try {
            return detail::ask_mask(transport_, masks_path(), body, options);
        } catch (const NotFound& error) {
            if (error.problem().reason != "no_scene") throw;
        }
        send();
        return detail::ask_mask(transport_, masks_path(), body, options);
    }

    // Tells the service that it is needed no more. No error when it was forgotten already.
    void forget() { transport_.ask("DELETE", "/v1/scenes/" + id_, nullptr, {}, {200, 204, 404}); }

    const std::string& id() const { return id_; }   // names the content: the same upload has the same
    double expires_s() const { return expires_s_; } // without use
    const std::vector<std::string>& warnings() const { return warnings_; }

private:
    friend class Client;
    KeptScene(detail::Transport transport, detail::Body upload)
        : transport_(std::move(transport)), upload_(std::make_shared<const detail::Body>(std::move(upload)))
    {
        send();
    }

    void send()
    {
        const httplib::Response answer = transport_.ask("POST", "/v1/scenes", upload_.get(), {}, {200, 201});
        const nlohmann::json kept = detail::json_from(answer);
        const std::string id = detail::text_at(kept, "id");
        // It becomes part of a path.
        if (!is_part_name(id)) detail::broken(answer, "the kept scene has no usable id");
        id_ = id;
        try {
            expires_s_ = kept.value("expires_s", 0.0);
            warnings_ = kept.value("warnings", std::vector<std::string>());
        } catch (const nlohmann::json::exception& error) {
            detail::broken(answer, error.what());
        }
    }
    std::string masks_path() const { return "/v1/scenes/" + id_ + "/masks"; }

    detail::Transport transport_;
    std::shared_ptr<const detail::Body> upload_; // shared by copies: it may be large
    std::string id_;
    double expires_s_ = 0;
    std::vector<std::string> warnings_;
};

// A penumbra service at http://HOST:PORT or https://..., with a path when a proxy has it under one. Holds no connection: safe to use from
// several threads, cheap to copy. Everything throws client::Error, and std::invalid_argument for arguments that could not be sent.
class Client {
public:
    explicit Client(const std::string& url, Options options = {}) : transport_(url, std::move(options)) {}

    // `scene` is of the scene file's form; its names are keys of `images`.
    Mask mask(const nlohmann::json& scene, const Images& images = {}, const MaskOptions& options = {}) const
    {
        return detail::ask_mask(transport_, "/v1/masks", detail::form(scene.dump(), images), options);
    }

    // Uploads a scene once, for many masks under changed lights, receivers or techniques.
    KeptScene keep(const nlohmann::json& scene, const Images& images = {}) const
    {
        return {transport_, detail::form(scene.dump(), images)};
    }

    // {"techniques": [...]} and {"version", "devices": [...]}, as the service says them.
    nlohmann::json techniques() const { return detail::json_from(transport_.ask("GET", "/v1/techniques", nullptr, {}, {200})); }
    nlohmann::json devices() const { return detail::json_from(transport_.ask("GET", "/v1/devices", nullptr, {}, {200})); }

    // Whether the service would compute now. One question, without retries.
    bool ready() const
    {
        const httplib::Response answer = transport_.once("GET", "/readyz", nullptr, {});
        if (answer.status != 200 && answer.status != 503) fail(detail::problem_of(answer));
        return answer.status == 200;
    }

private:
    detail::Transport transport_;
};

} // namespace penumbra::client
