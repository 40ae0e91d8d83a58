// The one door to the server: the gRPC service posefuse.v1.Room as gRPC-Web, on the origin the page came from.

import { Code, ConnectError, createClient } from "@connectrpc/connect";
import { createGrpcWebTransport } from "@connectrpc/connect-web";
import { Room } from "../gen/posefuse/v1/room_pb";

export const room = createClient(Room, createGrpcWebTransport({ baseUrl: location.origin }));

/** What went wrong, as a sentence for the operator. */
export function explain(error: unknown): string {
  const e = ConnectError.from(error);
  const unreachable = e.code === Code.Unavailable || (e.code === Code.Unknown && e.cause instanceof TypeError);
  if (unreachable && /fetch|network/i.test(e.rawMessage)) return "The server cannot be reached.";
  return e.rawMessage || `The server answered ${Code[e.code]}.`;
}

export function isCancelled(error: unknown): boolean {
  return ConnectError.from(error).code === Code.Canceled;
}
