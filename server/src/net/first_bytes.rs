//! Closes a connection that does not say which protocol it speaks.
//!
//! Hyper's own limits begin once it knows HTTP/1.1 from HTTP/2; until then (24 bytes, the length of HTTP/2's
//! preface) a silent peer would be held for ever.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use futures_util::future::{BoxFuture, FutureExt};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// Length of HTTP/2's connection preface.
const PREFACE: usize = 24;

/// A connection whose first bytes are due by a deadline.
pub(super) struct FirstBytes<Io> {
    io: Io,
    /// The deadline, and how many bytes came so far.
    waiting: Option<(BoxFuture<'static, ()>, usize)>,
}

impl<Io> FirstBytes<Io> {
    pub(super) fn new(io: Io, deadline: BoxFuture<'static, ()>) -> Self {
        Self {
            io,
            waiting: Some((deadline, 0)),
        }
    }
}

impl<Io: AsyncRead + Unpin> AsyncRead for FirstBytes<Io> {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let before = buffer.filled().len();
        let read = Pin::new(&mut this.io).poll_read(context, buffer);
        let Some((deadline, seen)) = &mut this.waiting else {
            return read;
        };
        *seen += buffer.filled().len() - before;
        if *seen >= PREFACE {
            this.waiting = None;
        } else if read.is_pending() && deadline.poll_unpin(context).is_ready() {
            let silent = "the peer sent no request";
            return Poll::Ready(Err(io::Error::new(io::ErrorKind::TimedOut, silent)));
        }
        read
    }
}

impl<Io: AsyncWrite + Unpin> AsyncWrite for FirstBytes<Io> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write(context, bytes)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.io).poll_write_vectored(context, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(context)
    }
}
