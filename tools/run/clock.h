// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One clock for pipelines on several machines, by GStreamer's network clock or by PTP.
#pragma once

#include <gst/gst.h>

#include <string>

/// Lets \p pipeline run by a clock that other machines share, and count its running time from that
/// clock's zero, by PTP from the year 2020, so that equal running times are equal instants on all
/// machines. \p server_port: the pipeline's own clock is given to others on this UDP port (0: not);
/// \p server: HOST:PORT of who gives it, "ptp" or "ptp:DOMAIN" for the network's PTP clock (domain
/// 0), "" for none of these.
/// Returns what serves the clock, to be unreferenced after the pipeline, or null where nothing is
/// served. Throws polyhull::Error where the port is taken, \p server is none of these, or nobody
/// answers within ten seconds.
GstObject* share_clock(GstElement* pipeline, int server_port, const std::string& server);
