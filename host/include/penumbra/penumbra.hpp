// penumbra: soft-shadow masks from depth maps, on OpenCL.
//
//     #include <penumbra/penumbra.hpp>
//
//     penumbra::Engine engine;
//     penumbra::Scene scene = penumbra::load_scene("scene.json");
//     penumbra::Mask mask = engine.mask(scene, penumbra::SoftShadowMap{.sides = penumbra::Sides::both});
//     penumbra::write_image("mask.exr", mask.visibility);
//
//     penumbra::Prepared prepared = engine.prepare(scene, penumbra::SoftShadowMap{});  // light and occluders, kept on the device
//     penumbra::Mask other = engine.shade(prepared, scene.receivers);                  // as often as receivers come
//
// Errors are exceptions of one type, penumbra::Error. Masks are visibility: 1 fully lit, 0 umbra, linear.
#pragma once

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/mask_job.hpp>
#include <penumbra/metrics.hpp>
#include <penumbra/scene.hpp>
#include <penumbra/stop.hpp>
#include <penumbra/technique.hpp>
