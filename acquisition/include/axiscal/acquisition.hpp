// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/acquisition/assembly_session.hpp"
#include "axiscal/acquisition/health_watch.hpp"
#include "axiscal/acquisition/journal.hpp"
#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/acquisition/pose_model.hpp"
#include "axiscal/acquisition/pose_path.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/session.hpp"
#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/session_header.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/acquisition/simulated_source.hpp"
#include "axiscal/acquisition/source.hpp"
#include "axiscal/acquisition/stillness.hpp"
#include "axiscal/acquisition/web_face.hpp"

/// @file
/// Data collection from live instruments: sources, the guided session, its journal and its user
/// interfaces.
///
/// open_source() opens a Source by its address: a serial port, a socket, a file or a simulation. A
/// SampleFeed merges several sources. A Session receives samples and commands, and provides a view,
/// events and, at the end, a calibration. A SessionFace displays the session on a terminal or in a
/// browser.
///
/// @code
/// for (const axiscal::SourceKind& kind : axiscal::source_kinds()) {
///   std::printf("%s%s\n", kind.address.c_str(), kind.available ? "" : " (not in this build)");
/// }
/// @endcode
///
/// Traps:
/// - A session reports a reading as captured only after the reading is stored on the disk. If the
///   disk is full, the session waits, and the program keeps running.
/// - The same samples and commands give the same readings. A journal with raw samples can therefore
///   be replayed.
