// Silhouettes of meshes as people have them, sound and broken.
#include <chrono>
#include <iostream>

#include "io/mesh_io.hpp"
#include "silhouette/oracle.hpp"

namespace penumbra::test {
namespace {

const std::string models = PENUMBRA_TEST_MODELS;

Imath::Box3d box_of(const Topology& topology)
{
    Imath::Box3d box;
    for (const Imath::V3f& v : topology.vertices()) box.extendBy(Vec3(v));
    return box;
}

void check_around(const Topology& topology)
{
    const Imath::Box3d box = box_of(topology);
    for (const Vec3& direction : {Vec3(1, 2, 3), Vec3(-3, 1, 0.5), Vec3(0, 1, 0), Vec3(0.01, -0.02, 0.03), Vec3(0, 0, 0)}) {
        SCOPED_TRACE(direction);
        checked(topology, box.center() + direction * box.size().length());
    }
}

template <class F> double milliseconds(F&& f)
{
    const auto begin = std::chrono::steady_clock::now();
    f();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

TEST(SilhouetteOfMeshes, TheBunnyIsOneClosedSurface)
{
    const Topology topology = topology_of(read_mesh(PENUMBRA_BUNNY, "bunny"));
    EXPECT_EQ(topology.triangles().size() + topology.left_out(), 69666u);
    EXPECT_EQ(topology.open_edges(), 0u);
    EXPECT_EQ(topology.nonmanifold_edges(), 0u);
    for (std::uint32_t t = 0; t < topology.triangles().size(); ++t) ASSERT_TRUE(topology.closed(t));
    check_around(topology);
}

TEST(SilhouetteOfMeshes, OthersSoundAndBroken)
{
    const std::string glmark2 = std::string(PENUMBRA_BUNNY).substr(0, std::string(PENUMBRA_BUNNY).rfind('/'));
    for (const std::string& path :
         {glmark2 + "/horse.3ds", glmark2 + "/cat.3ds", models + "/OBJ/spider.obj", models + "/OBJ/WusonOBJ.obj", models + "/PLY/Wuson.ply",
          models + "/STL/Spider_binary.stl", models + "/STL/sphereWithHole.stl", models + "/3DS/fels.3ds",
          models + "/OBJ/concave_polygon.obj", models + "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"}) {
        SCOPED_TRACE(path);
        const Topology topology = topology_of(read_mesh(path, "mesh"));
        EXPECT_GT(topology.triangles().size(), 0u);
        check_around(topology);
    }
}

// Prints what they take; the limits are many times that, so that a busy machine passes and a quadratic step does not.
TEST(SilhouetteOfMeshes, Times)
{
    const TriangleMesh bunny = read_mesh(PENUMBRA_BUNNY, "bunny");
    const TriangleMesh large = torus(1000, 250);
    for (const TriangleMesh* mesh : {&bunny, &large}) {
        const double make = milliseconds([mesh] { topology_of(*mesh); });
        const Topology topology = topology_of(*mesh);
        const Imath::Box3d box = box_of(topology);
        double best = 1e9, worst = 0;
        std::size_t edges = 0;
        for (int i = 0; i < 20; ++i) {
            const double ms = milliseconds([&] {
                edges = silhouette_of(topology, box.center() + Vec3(std::cos(i), std::sin(i), 1) * box.size().length()).edges.size();
            });
            best = std::min(best, ms);
            worst = std::max(worst, ms);
        }
        std::cout << mesh->triangles.size() << " triangles: topology " << make << " ms, silhouette " << best << " to " << worst << " ms, "
                  << edges << " edges, " << topology.bytes() << " bytes\n";
        EXPECT_LT(make, 10000);
        EXPECT_LT(best, 500);
    }
}

} // namespace
} // namespace penumbra::test
