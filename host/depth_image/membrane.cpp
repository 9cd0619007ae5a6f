// Laplace's equation over the joined pixels of a depth image, by conjugate gradients with a multigrid of aggregated pixels as preconditioner.
//
// Pixels are joined in a graph that is torn along silhouettes, so coarse levels are made from the graph and not from the image: each level
// joins nodes of a 2 x 2 block where they hang together (aggregation; Braess 1995, Towards algebraic multigrid for elliptic problems of
// second order; Notay 2010, An aggregation-based algebraic multigrid method).
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "depth_image/thickness.hpp"
#include "scene/stop.hpp"

namespace penumbra {
namespace {

// A symmetric graph: node i has links begin[i] to begin[i + 1], and is held where it is with the weight hold[i].
struct Graph {
    std::vector<std::uint32_t> begin, to;
    std::vector<float> weight;   // of a link
    std::vector<float> hold;     // kept apart from the links' weights, of which it may be a tiny part
    std::vector<float> diagonal; // all of them together
    std::vector<std::int32_t> x, y;
    std::vector<std::uint32_t> coarse; // its node on the next level

    std::size_t size() const { return hold.size(); }
};

struct Link {
    std::uint32_t from, to;
    float weight;
};

// Sorts links by their node and adds up those that stand twice. Counting sort, twice.
void set_links(Graph& graph, std::vector<Link> links)
{
    const std::size_t n = graph.size();
    const auto sorted_by = [&](auto key) {
        std::vector<std::uint32_t> start(n + 1);
        for (const Link& link : links) ++start[key(link) + 1];
        for (std::size_t i = 0; i < n; ++i) start[i + 1] += start[i];
        std::vector<Link> result(links.size());
        for (const Link& link : links) result[start[key(link)]++] = link;
        links = std::move(result);
    };
    sorted_by([](const Link& l) { return l.to; });
    sorted_by([](const Link& l) { return l.from; });
    graph.begin.assign(n + 1, 0);
    for (std::size_t i = 0; i < links.size(); ++i) {
        if (i > 0 && links[i].from == links[i - 1].from && links[i].to == links[i - 1].to) {
            graph.weight.back() += links[i].weight;
            continue;
        }
        graph.to.push_back(links[i].to);
        graph.weight.push_back(links[i].weight);
        ++graph.begin[links[i].from + 1];
    }
    for (std::size_t i = 0; i < n; ++i) graph.begin[i + 1] += graph.begin[i];
    graph.diagonal = graph.hold;
    for (std::size_t i = 0; i < n; ++i)
        for (std::uint32_t e = graph.begin[i]; e < graph.begin[i + 1]; ++e) graph.diagonal[i] += graph.weight[e];
}

// The next level: nodes of a 2 x 2 block that hang together become one.
Graph coarser(Graph& fine)
{
    const std::size_t n = fine.size();
    fine.coarse.resize(n);
    std::vector<std::uint32_t> root(n);
    for (std::size_t i = 0; i < n; ++i) root[i] = static_cast<std::uint32_t>(i);
    const auto find = [&](std::uint32_t i) {
        while (root[i] != i) i = root[i] = root[root[i]];
        return i;
    };
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t e = fine.begin[i]; e < fine.begin[i + 1]; ++e) {
            const std::uint32_t j = fine.to[e];
            if (fine.x[i] / 2 == fine.x[j] / 2 && fine.y[i] / 2 == fine.y[j] / 2) root[find(i)] = find(j);
        }
    Graph coarse;
    std::vector<std::uint32_t> number(n, UINT32_MAX);
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t r = find(i);
        if (number[r] == UINT32_MAX) {
            number[r] = static_cast<std::uint32_t>(coarse.x.size());
            coarse.x.push_back(fine.x[i] / 2);
            coarse.y.push_back(fine.y[i] / 2);
            coarse.hold.push_back(0);
        }
        fine.coarse[i] = number[r];
    }
    std::vector<Link> links;
    for (std::uint32_t i = 0; i < n; ++i) {
        coarse.hold[fine.coarse[i]] += fine.hold[i];
        for (std::uint32_t e = fine.begin[i]; e < fine.begin[i + 1]; ++e) {
            const std::uint32_t a = fine.coarse[i], b = fine.coarse[fine.to[e]];
            if (a != b) links.push_back({a, b, fine.weight[e]});
        }
    }
    set_links(coarse, std::move(links));
    return coarse;
}

using Numbers = std::vector<float>;

float row_times(const Graph& graph, const Numbers& v, std::size_t i)
{
    float sum = graph.diagonal[i] * v[i];
    for (std::uint32_t e = graph.begin[i]; e < graph.begin[i + 1]; ++e) sum -= graph.weight[e] * v[graph.to[e]];
    return sum;
}

// A sweep of Gauss and Seidel, forwards or backwards: the two together are symmetric, as conjugate gradients want.
void sweep(const Graph& graph, Numbers& v, const Numbers& right, bool forwards)
{
    const std::size_t n = graph.size();
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t i = forwards ? k : n - 1 - k;
        float sum = right[i];
        for (std::uint32_t e = graph.begin[i]; e < graph.begin[i + 1]; ++e) sum += graph.weight[e] * v[graph.to[e]];
        v[i] = sum / graph.diagonal[i];
    }
}

// One W cycle for graph v = right, from v = 0.
void cycle(const std::vector<Graph>& levels, std::size_t level, Numbers& v, const Numbers& right)
{
    const Graph& graph = levels[level];
    v.assign(graph.size(), 0);
    if (level + 1 == levels.size()) {
        for (int turn = 0; turn < 8; ++turn) sweep(graph, v, right, true), sweep(graph, v, right, false);
        return;
    }
    sweep(graph, v, right, true);
    const Graph& below = levels[level + 1];
    Numbers rest(below.size()), correction;
    for (std::size_t i = 0; i < graph.size(); ++i) rest[graph.coarse[i]] += right[i] - row_times(graph, v, i);
    cycle(levels, level + 1, correction, rest);
    if (level > 0) { // twice below the finest two levels: aggregates alone are too stiff
        Numbers left(below.size()), more;
        for (std::size_t i = 0; i < below.size(); ++i) left[i] = rest[i] - row_times(below, correction, i);
        cycle(levels, level + 1, more, left);
        for (std::size_t i = 0; i < below.size(); ++i) correction[i] += more[i];
    }
    for (std::size_t i = 0; i < graph.size(); ++i) v[i] += correction[graph.coarse[i]];
    sweep(graph, v, right, false);
}

double dot(const Numbers& a, const Numbers& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i]) * static_cast<double>(b[i]);
    return sum;
}

// graph v = right, by preconditioned conjugate gradients from v = 0, flexible (Polak and Ribiere) because a cycle rounds.
Numbers solve(const std::vector<Graph>& levels, const Numbers& right)
{
    const Graph& graph = levels.front();
    Numbers v(graph.size(), 0), rest = right, direction, cycled, before, product(graph.size());
    const double whole = dot(rest, rest);
    double last = 0;
    for (int turn = 0; turn < 60; ++turn) {
        check_stop();
        if (!(dot(rest, rest) > 1e-10 * whole)) break;
        cycle(levels, 0, cycled, rest);
        const double now = dot(rest, cycled);
        const double beta = turn == 0 ? 0 : (now - dot(before, cycled)) / last;
        direction.resize(graph.size());
        for (std::size_t i = 0; i < graph.size(); ++i) direction[i] = cycled[i] + static_cast<float>(beta) * direction[i];
        for (std::size_t i = 0; i < graph.size(); ++i) product[i] = row_times(graph, direction, i);
        const double bend = dot(direction, product);
        if (!(bend > 0)) break;
        const auto alpha = static_cast<float>(dot(rest, direction) / bend);
        before = rest;
        for (std::size_t i = 0; i < graph.size(); ++i) {
            v[i] += alpha * direction[i];
            rest[i] -= alpha * product[i];
        }
        last = now;
    }
    return v;
}

} // namespace

std::vector<float> membrane(const DepthFit& fit, const std::vector<std::uint8_t>& silhouette)
{
    // Free pixels are the unknowns: how far the membrane lies from the surface, which is a good first guess and keeps float32's digits.
    constexpr float held = 1e-7f;
    constexpr std::uint32_t none = UINT32_MAX;
    std::vector<std::uint32_t> number(fit.value.size(), none);
    Graph graph;
    for (int y = 0; y < fit.height; ++y)
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.there[i] || silhouette[i]) continue;
            number[i] = static_cast<std::uint32_t>(graph.x.size());
            graph.x.push_back(x);
            graph.y.push_back(y);
        }
    graph.hold.assign(graph.x.size(), held);
    if (graph.x.empty()) return fit.value;

    Numbers right(graph.size(), 0);
    std::vector<Link> links;
    links.reserve(4 * graph.size());
    const auto join = [&](std::size_t i, std::size_t j) {
        if (!fit.there[i] || !fit.there[j]) return;
        const float step = fit.value[j] - fit.value[i];
        if (std::abs(step) > std::max(fit.joint(i), fit.joint(j))) return;
        const std::uint32_t a = number[i], b = number[j];
        if (a != none) right[a] += step;
        if (b != none) right[b] -= step;
        if (a != none && b == none) graph.hold[a] += 1;
        if (b != none && a == none) graph.hold[b] += 1;
        if (a != none && b != none) links.push_back({a, b, 1}), links.push_back({b, a, 1});
    };
    for (int y = 0; y < fit.height; ++y)
        for (int x = 0; x < fit.width; ++x) {
            if (x + 1 < fit.width) join(fit.index(x, y), fit.index(x + 1, y));
            if (y + 1 < fit.height) join(fit.index(x, y), fit.index(x, y + 1));
        }
    set_links(graph, std::move(links));
    std::vector<Graph> levels;
    levels.push_back(std::move(graph));
    while (levels.back().size() > 64 && levels.size() < 20) {
        Graph next = coarser(levels.back());
        if (next.size() == levels.back().size()) break;
        levels.push_back(std::move(next));
    }

    const Numbers away = solve(levels, right);
    std::vector<float> result = fit.value;
    for (std::size_t i = 0; i < result.size(); ++i)
        if (number[i] != none) result[i] = std::max(fit.value[i] + away[number[i]], 0.f);
    return result;
}

} // namespace penumbra
