// From the polygons of a file to the triangles of a scene.
#pragma once

#include <string_view>

#include "io/polygon_soup.hpp"
#include "scene/object_placement.hpp"

namespace penumbra {

// Places the soup, in double precision until then; makes triangles; joins vertices at equal float32 positions, and with `weld` above 0
// (scene units) those that are no further apart, which is said in a warning, as are cracks that are left. Points, lines and triangles with
// two corners at one place go; points and lines are warned of. Throws invalid_input for positions that are not finite, are beyond float32
// once placed, or give no triangles, and too_large.
TriangleMesh build_mesh(PolygonSoup soup, const ObjectPlacement& placement, double weld, const MeshSource& source);

} // namespace penumbra
