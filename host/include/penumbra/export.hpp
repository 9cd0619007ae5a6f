#pragma once

#define PENUMBRA_API __attribute__((visibility("default")))
