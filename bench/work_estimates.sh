#!/bin/sh
# Prints what masks are estimated to take beside what was counted (docs/service_hardening.md). Needs a build with the tests.
set -eu
cd "$(dirname "$0")/.."
build/release/tests/test_engine --gtest_filter='WorkEstimate.IsWithinTenTimesOfWhatIsCounted' | grep '^|'
