(** Pairs of robots: how far apart at one time suffices for all times that clocks allow. *)

Require Import Reals Lra Psatz.
From LtlPlan Require Import Vectors Margins.
Open Scope R_scope.

(** Distances count height [k] times: the squared distance is the form of diag(1, 1, k^2). *)
Definition stretched (k : R) : sym := Sym 1 1 (k * k) 0 0 0.

Lemma stretched_quad : forall k a,
  quad (stretched k) a = vx a * vx a + vy a * vy a + k * vz a * (k * vz a).
Proof. intros k a; unfold quad, form, dot, apply; simpl; ring. Qed.

Lemma stretched_semidefinite : forall k, semidefinite (stretched k).
Proof.
  intros k a; rewrite stretched_quad.
  pose proof (square_nonneg (vx a)); pose proof (square_nonneg (vy a));
    pose proof (square_nonneg (k * vz a)); lra.
Qed.

(** A move by m changes the distance by at most s m, s the greater of 1 and k. *)
Lemma stretched_grows : forall k s, 0 <= k -> 1 <= s -> k <= s ->
  grows_at_most (stretched k) (s * s).
Proof.
  intros k s Hk H1 Hs a; rewrite stretched_quad; unfold dot.
  pose proof (square_nonneg (vx a)); pose proof (square_nonneg (vy a)); pose proof (square_nonneg (vz a)).
  assert (k * k <= s * s) by nra. assert (1 <= s * s) by nra.
  replace (k * vz a * (k * vz a)) with (k * k * (vz a * vz a)) by ring. nra.
Qed.

(** Where two points are apart by D and what a move of length m may take, they are apart
    by D after it: of margins, of steps between pieces, of what is flown meanwhile. *)
Theorem apart_moved : forall Q s D m gap move, semidefinite Q -> 0 <= s ->
  grows_at_most Q (s * s) -> 0 <= D -> 0 <= m -> dot move move <= m * m ->
  (D + s * m) * (D + s * m) <= quad Q gap -> D * D <= quad Q (add gap move).
Proof.
  intros Q s D m gap move PSD Hs G HD Hm Hmove H; apply Rnot_lt_le; intros N.
  set (y := add gap move) in *; set (u := sqrt (quad Q y)).
  assert (Hu : u * u = quad Q y) by (apply sqrt_sqrt, PSD).
  assert (U0 : 0 <= u) by apply sqrt_pos.
  assert (UD : u < D) by nra.
  assert (B : quad Q (add y (scale (-1) move)) <= (u + s * m) * (u + s * m)).
  { apply quad_add_le; auto; [nra | lra|].
    replace (quad Q (scale (-1) move)) with (quad Q move)
      by (unfold quad, form, dot, apply, scale; simpl; ring).
    apply Rle_trans with (1 := G move).
    replace (s * m * (s * m)) with (s * s * (m * m)) by ring.
    apply Rmult_le_compat_l; auto; apply square_nonneg. }
  replace (add y (scale (-1) move)) with gap in B
    by (unfold y, add, scale; destruct gap, move; simpl; f_equal; ring).
  assert (0 <= s * m) by nra. nra.
Qed.

(** A plane across the way parts two bodies: all of the one is beyond it by a gap. *)
Theorem plane_parts : forall n low high D a b, 0 < low - high ->
  D * dot n n <= (low - high) * (low - high) -> low <= dot n a -> dot n b <= high ->
  D <= dot (sub a b) (sub a b).
Proof.
  intros n low high D a b P H A B; pose proof (cauchy_schwarz n (sub a b)) as C.
  rewrite dot_sub in C; pose proof (dot_square n) as N.
  set (g := dot n a - dot n b) in *; assert (G : low - high <= g) by (unfold g; lra).
  assert (S : (low - high) * (low - high) <= g * g) by (apply Rmult_le_compat; lra).
  assert (NZ : dot n n <> 0) by (intros Z; rewrite Z in *; nra).
  apply Rmult_le_reg_r with (dot n n); lra.
Qed.

(** ** Speed bounds what is flown *)

(** The mean value inequality (Coq's own theorem rests on one more axiom). *)
Section Mean.
  Variables (g g' : R -> R) (a b c : R).
  Hypothesis order : a <= b.
  Hypothesis slope : forall x, a <= x <= b -> derivable_pt_lim g x (g' x).
  Hypothesis bound : forall x, a <= x <= b -> g' x <= c.

  Lemma mean_nearly : forall e, 0 < e -> g b - g a <= (c + e) * (b - a).
  Proof.
    intros e He.
    set (fine := fun x => g x - g a <= (c + e) * (x - a)).
    set (S := fun x => a <= x <= b /\ forall y, a <= y <= x -> fine y).
    destruct (completeness S) as [z [Up Least]].
    { exists b; intros x [Hx _]; lra. }
    { exists a; split; [lra|]; intros y Hy; replace y with a by lra; unfold fine; lra. }
    assert (Hz : a <= z <= b).
    { split; [apply Up; split; [lra|]; intros y Hy; replace y with a by lra; unfold fine; lra|].
      apply Least; intros x [Hx _]; lra. }
    assert (Before : forall y, a <= y < z -> fine y).
    { intros y Hy; destruct (Rle_lt_dec (g y - g a) ((c + e) * (y - a))) as [L|L]; auto.
      exfalso; assert (z <= y); [|lra]; apply Least; intros x [Hx H].
      destruct (Rle_lt_dec x y); auto; specialize (H y); unfold fine in H; lra. }
    destruct (slope z Hz e He) as [d Hd]; specialize (bound z Hz).
    assert (Near : forall h, Rabs h < d -> h <> 0 -> - e < (g (z + h) - g z) / h - g' z < e).
    { intros h Hh Nh; specialize (Hd h Nh Hh); apply Rabs_def2 in Hd; lra. }
    pose proof (cond_pos d) as Pd.
    assert (At : fine z).
    { destruct (Req_dec a z) as [<-|NE]; [unfold fine; lra|].
      set (k := Rmin (d / 2) ((z - a) / 2)).
      assert (K : 0 < k /\ k < d /\ k < z - a).
      { unfold k; pose proof (Rmin_l (d / 2) ((z - a) / 2)); pose proof (Rmin_r (d / 2) ((z - a) / 2)).
        assert (0 < Rmin (d / 2) ((z - a) / 2)) by (apply Rmin_glb_lt; lra). lra. }
      assert (B := Before (z - k)); unfold fine in B |- *.
      destruct (Near (- k)) as [_ N]; [rewrite Rabs_Ropp, Rabs_right; lra | lra|].
      replace (z + - k) with (z - k) in N by ring.
      assert (E : g z - g (z - k) = (g (z - k) - g z) / - k * k) by (field; lra).
      assert (g z - g (z - k) <= (c + e) * k) by (rewrite E; apply Rmult_le_compat_r; lra).
      assert (g (z - k) - g a <= (c + e) * (z - k - a)) by (apply B; lra). lra. }
    destruct (Req_dec z b) as [<-|NE]; [exact At|].
    exfalso; set (k := Rmin (d / 2) (b - z)).
    assert (K : 0 < k /\ k < d /\ k <= b - z).
    { unfold k; pose proof (Rmin_l (d / 2) (b - z)); pose proof (Rmin_r (d / 2) (b - z)).
      assert (0 < Rmin (d / 2) (b - z)) by (apply Rmin_glb_lt; lra). lra. }
    assert (z + k <= z); [|lra]. apply Up; split; [lra|]; intros y Hy.
    destruct (Rlt_le_dec y z); [apply Before; lra|]; destruct (Req_dec y z) as [->|]; auto.
    destruct (Near (y - z)) as [_ N]; [rewrite Rabs_right; lra | lra|].
    replace (z + (y - z)) with y in N by ring.
    assert (E : g y - g z = (g y - g z) / (y - z) * (y - z)) by (field; lra).
    assert (g y - g z <= (c + e) * (y - z)) by (rewrite E; apply Rmult_le_compat_r; lra).
    unfold fine in *; lra.
  Qed.

  Lemma mean_value : g b - g a <= c * (b - a).
  Proof.
    apply Rnot_lt_le; intros L.
    destruct (Req_dec a b) as [<-|NE]; [lra|].
    set (gap := g b - g a - c * (b - a)).
    assert (M : g b - g a <= (c + gap / (2 * (b - a))) * (b - a))
      by (apply mean_nearly; apply Rdiv_lt_0_compat; unfold gap; lra).
    replace ((c + gap / (2 * (b - a))) * (b - a)) with (c * (b - a) + gap / 2) in M by (field; lra).
    unfold gap in *; lra.
  Qed.
End Mean.

Section Speed.
  Variables (p v : R -> vec) (a b V : R).
  Hypothesis moves : forall t, a <= t <= b ->
    derivable_pt_lim (fun t => vx (p t)) t (vx (v t)) /\
    derivable_pt_lim (fun t => vy (p t)) t (vy (v t)) /\
    derivable_pt_lim (fun t => vz (p t)) t (vz (v t)).
  Hypothesis speed : forall t, a <= t <= b -> dot (v t) (v t) <= V * V.
  Hypothesis V_nonneg : 0 <= V.

  Theorem flown : forall t u, a <= t -> t <= u -> u <= b ->
    dot (sub (p u) (p t)) (sub (p u) (p t)) <= V * (u - t) * (V * (u - t)).
  Proof.
    intros t u Ha Htu Hb; destruct (Req_dec t u) as [<-|NE].
    { unfold dot, sub; simpl; lra. }
    set (w := sub (p u) (p t)).
    set (g := fun x => vx w * vx (p x) + vy w * vy (p x) + vz w * vz (p x)).
    assert (Dg : forall x, t <= x <= u -> derivable_pt_lim g x (dot w (v x))).
    { intros x Hx; destruct (moves x) as (X & Y & Z); [lra|]; unfold g, dot.
      apply (derivable_pt_lim_plus (fun x => vx w * vx (p x) + vy w * vy (p x)) (fun x => vz w * vz (p x)));
        [apply (derivable_pt_lim_plus (fun x => vx w * vx (p x)) (fun x => vy w * vy (p x)))|];
        apply (derivable_pt_lim_scal (fun x => _ (p x))); auto. }
    pose proof (dot_square w) as W0; set (d := u - t); assert (Hd : 0 < d) by (unfold d; lra).
    set (n := sqrt (dot w w)); assert (N : n * n = dot w w) by (apply sqrt_sqrt; auto).
    assert (N0 : 0 <= n) by apply sqrt_pos.
    assert (M : g u - g t <= n * V * (u - t)).
    { apply (mean_value g (fun x => dot w (v x))); auto; intros x Hx.
      apply (square_le (dot w (v x)) (n * V)); [apply Rmult_le_pos; auto|].
      apply Rle_trans with (1 := cauchy_schwarz w (v x)).
      replace (n * V * (n * V)) with (dot w w * (V * V)) by (rewrite <- N; ring).
      apply Rmult_le_compat_l; auto; apply speed; lra. }
    assert (E : g u - g t = dot w w) by (unfold g, w, dot, sub; simpl; ring).
    rewrite E, <- N in M; fold d in M.
    assert (n <= V * d); [|rewrite <- N; apply Rmult_le_compat; auto].
    destruct (Req_dec n 0) as [->|NZ]; [apply Rmult_le_pos; lra|].
    apply Rmult_le_reg_l with n; lra.
  Qed.
End Speed.
