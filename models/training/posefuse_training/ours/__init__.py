"""Our own models: a causal one for live use and one that looks at both sides of a gap.

Both correct simple methods instead of replacing them: a network says, joint by joint, which of several simple continuations to
believe, and adds what it learned. With no knowledge they are a simple method; just after a joint was lost they agree with
where it was.
"""
