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

(** ** Speed bounds what is flown *)

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
    destruct (MVT_cor2 g (fun x => dot w (v x)) t u) as (c & E & Hc); [lra | auto|].
    assert (W : dot w w = dot w (v c) * (u - t)).
    { rewrite <- E; unfold g, w, dot, sub; simpl; ring. }
    pose proof (cauchy_schwarz w (v c)) as CS; pose proof (dot_square w) as W0.
    assert (S : dot (v c) (v c) <= V * V) by (apply speed; lra).
    set (d := u - t) in *; assert (Hd : 0 < d) by (unfold d; lra).
    destruct (Req_dec (dot w w) 0) as [Z|NZ]; [rewrite Z; apply square_nonneg|].
    assert (P : 0 < dot w w) by lra.
    assert (Sq : dot w w * dot w w <= dot w w * (V * V) * (d * d)).
    { rewrite W at 1 2.
      replace (dot w (v c) * d * (dot w (v c) * d)) with (dot w (v c) * dot w (v c) * (d * d)) by ring.
      apply Rmult_le_compat_r; [apply square_nonneg|].
      apply Rle_trans with (1 := CS), Rmult_le_compat_l; auto. }
    apply Rmult_le_reg_l with (dot w w); auto.
    replace (dot w w * (V * d * (V * d))) with (dot w w * (V * V) * (d * d)) by ring; auto.
  Qed.
End Speed.
