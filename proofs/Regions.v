(** Trees for regions and for limits.

    A region is a union of parts, each a list of inequalities.  An inequality has two
    polynomials in time: [kept] is not negative where it holds, [broken] is positive
    where it fails.  At a margin the two differ, and both speak of a whole ball.  Bodies
    are convex bodies within the region: its parts, and what parts become across faces. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing Halves Tree.
Import ListNotations.

(** ** The algorithm *)

Record inequality := Inequality { kept : list Z; broken : list Z }.
Record region := Region { parts : list (list inequality); bodies : list (list (list Z)) }.

Inductive mark := Must | No | Cross | Open.

Definition both (f : list Z -> list Z) (q : inequality) : inequality :=
  Inequality (f (kept q)) (f (broken q)).
Definition cut (f : list Z -> list Z) (r : region) : region :=
  Region (map (map (both f)) (parts r)) (map (map f) (bodies r)).

Definition body_kept (b : list (list Z)) : bool := forallb all_nonneg b.
Definition part_broken (p : list inequality) : bool :=
  existsb (fun q => all_positive (broken q)) p.

(** One inequality is crossed, all others are kept. *)
Fixpoint part_crossed (way : list Z -> list Z) (p : list inequality) : bool :=
  match p with
  | [] => false
  | q :: r =>
      (comes (way (kept q)) && body_kept (map kept r)) || (all_nonneg (kept q) && part_crossed way r)
  end.

(** One part is crossed, all others are broken. *)
Fixpoint crossed (way : list Z -> list Z) (ps : list (list inequality)) : bool :=
  match ps with
  | [] => false
  | p :: r =>
      (part_crossed way p && forallb part_broken r) || (part_broken p && crossed way r)
  end.

Definition holds (m : mark) (r : region) : bool :=
  match m with
  | Must => existsb body_kept (bodies r)
  | No => forallb part_broken (parts r)
  | Cross => crossed (fun l => l) (parts r) || crossed (@rev Z) (parts r)
  | Open => true
  end.

Definition check_region (r : region) (steps : list (step mark)) : option (list (leaf mark)) :=
  check_tree _ _ (cut first_half) (cut second_half) holds r steps.

(** ** What the marks say *)

Open Scope R_scope.

Definition times : Type := R -> R.
Record meaning := Meaning {
  m_parts : list (list (times * times)); m_bodies : list (list times) }.

Definition known_inequality (a b : R) (q : inequality) (f : times * times) : Prop :=
  represents (kept q) (fst f) a b /\ represents (broken q) (snd f) a b.
Definition known (f : meaning) (a b : R) (r : region) : Prop :=
  Forall2 (Forall2 (known_inequality a b)) (parts r) (m_parts f) /\
  Forall2 (Forall2 (fun l g => represents l g a b)) (bodies r) (m_bodies f).

(** By the polynomials, time [x] is in the region, where the margin is zero. *)
Definition in_part (p : list (times * times)) (x : R) : Prop := forall f, In f p -> 0 <= fst f x.
Definition inside (f : meaning) (x : R) : Prop := exists p, In p (m_parts f) /\ in_part p x.

Definition says (f : meaning) (m : mark) (a b : R) : Prop :=
  match m with
  | Open => True
  | Must => always (fun x => exists g, In g (m_bodies f) /\ forall h, In h g -> 0 <= h x) a b
  | No => always (fun x => forall p, In p (m_parts f) -> exists h, In h p /\ 0 < snd h x) a b
  | Cross => (forall p h x, In p (m_parts f) -> In h p -> 0 < snd h x -> fst h x < 0) ->
      comes_once (inside f) a b \/ goes_once (inside f) a b
  end.

Lemma known_cut : forall (h : list Z -> list Z) f a b a' b' r,
  (forall l g, represents l g a b -> represents (h l) g a' b') ->
  known f a b r -> known f a' b' (cut h r).
Proof.
  intros h f a b a' b' r H [P B]; split; cbn.
  - induction P as [|p g ps gs K P IH]; constructor; auto.
    clear - H K; induction K as [|q f p g [K1 K2] K IH]; constructor; auto; split; cbn; auto.
  - induction B as [|p g ps gs K P' IH]; constructor; auto.
    clear - H K; induction K; constructor; auto.
Qed.

Lemma body_sound : forall a b p fs, a < b -> Forall2 (fun l g => represents l g a b) p fs ->
  body_kept p = true -> forall x, a <= x <= b -> forall h, In h fs -> 0 <= h x.
Proof.
  intros a b p fs Hab F; induction F as [|l g p fs K F IH]; intros H x Hx h Hh; [destruct Hh|].
  cbn in H; apply andb_prop in H as [H1 H2]; destruct Hh as [<-|Hh]; [|apply IH; auto].
  apply (all_nonneg_sound l g a b); auto.
Qed.

Lemma broken_sound : forall a b p fs, a < b -> Forall2 (known_inequality a b) p fs ->
  part_broken p = true -> forall x, a <= x <= b -> exists h, In h fs /\ 0 < snd h x.
Proof.
  intros a b p fs Hab F; induction F as [|q g p fs [_ K] F IH]; intros H x Hx; [discriminate|].
  cbn in H; apply orb_prop in H as [H|H].
  - exists g; split; [left; auto | apply (all_positive_sound (broken q) (snd g) a b); auto].
  - destruct (IH H x Hx) as (h & Hh & Ph); exists h; split; [right; auto | auto].
Qed.

Lemma kept_represents : forall a b p fs, Forall2 (known_inequality a b) p fs ->
  Forall2 (fun l g => represents l g a b) (map kept p) (map fst fs).
Proof. intros a b p fs F; induction F as [|q f p fs [K _] F IH]; constructor; auto. Qed.

(** Crossing in either direction. *)
Definition once (Q : (R -> Prop) -> R -> R -> Prop) : Prop :=
  forall P P' a b, (forall x, a <= x <= b -> (P x <-> P' x)) -> Q P a b -> Q P' a b.

Lemma comes_once_same : once comes_once.
Proof.
  intros P P' a b E (z & Hz & H); exists z; split; auto; intros x Hx; rewrite <- E; auto.
Qed.
Lemma goes_once_same : once goes_once.
Proof.
  intros P P' a b E (z & Hz & H); exists z; split; auto; intros x Hx; rewrite <- E; auto.
Qed.

Section Crossed.
  Variables (way : list Z -> list Z) (Q : (R -> Prop) -> R -> R -> Prop) (a b : R).
  Hypothesis forward : a < b.
  Hypothesis Q_once : once Q.
  Hypothesis way_sound : forall l f, represents l f a b -> comes (way l) = true ->
    Q (fun x => 0 <= f x) a b.

  Lemma part_crossed_sound : forall p fs, Forall2 (known_inequality a b) p fs ->
    part_crossed way p = true -> Q (in_part fs) a b.
  Proof.
    intros p fs F; induction F as [|q f p fs [Kq Bq] F IH]; intros H; [discriminate|].
    cbn in H; apply orb_prop in H as [H|H]; apply andb_prop in H as [H1 H2].
    - apply (Q_once (fun x => 0 <= fst f x)); [|apply (way_sound (kept q)); auto].
      intros x Hx; pose proof (body_sound a b _ _ forward (kept_represents _ _ _ _ F) H2 x Hx) as K.
      split; [intros P h [<-|Hh]; auto; apply K, in_map; auto | intros P; apply P; left; auto].
    - apply (Q_once (in_part fs)); [|apply IH; auto].
      intros x Hx; split; intros P h Hh; [|apply P; right; auto].
      destruct Hh as [<-|Hh]; [apply (all_nonneg_sound (kept q) (fst f) a b); auto | apply P; auto].
  Qed.

  Lemma crossed_sound : forall ps fs,
    (forall p h x, In p fs -> In h p -> 0 < snd h x -> fst h x < 0) ->
    Forall2 (Forall2 (known_inequality a b)) ps fs ->
    crossed way ps = true -> Q (fun x => exists p, In p fs /\ in_part p x) a b.
  Proof.
    intros ps fs Exact F; revert Exact; induction F as [|p f ps fs K F IH]; intros Exact H;
      [discriminate|].
    assert (Out : forall p f, Forall2 (known_inequality a b) p f ->
      (forall h x, In h f -> 0 < snd h x -> fst h x < 0) ->
      part_broken p = true -> forall x, a <= x <= b -> ~ in_part f x).
    { intros p' f' K' E B x Hx I; destruct (broken_sound a b p' f' forward K' B x Hx) as (h & Hh & P).
      specialize (E h x Hh P); specialize (I h Hh); lra. }
    cbn in H; apply orb_prop in H as [H|H]; apply andb_prop in H as [H1 H2].
    - apply (Q_once (in_part f)); [|apply (part_crossed_sound p); auto].
      intros x Hx; split; [intros I; exists f; split; [left|]; auto|].
      intros (g & [<-|Hg] & I); auto; exfalso; clear - F H2 Exact Out Hg I Hx.
      assert (Exact' : forall p h x, In p fs -> In h p -> 0 < snd h x -> fst h x < 0)
        by (intros p h y Hp; apply (Exact p); right; auto); clear Exact.
      induction F as [|q g' qs gs K F IH]; [destruct Hg|].
      cbn in H2; apply andb_prop in H2 as [B1 B2]; destruct Hg as [->|Hg].
      + apply (Out q g K) with (x := x); auto; intros h y; apply (Exact' g); left; auto.
      + apply IH; auto; intros p0 h y Hp; apply (Exact' p0); right; auto.
    - apply (Q_once (fun x => exists p, In p fs /\ in_part p x));
        [|apply IH; auto; intros p' h x Hp; apply (Exact p'); right; auto].
      intros x Hx; split; intros (g & Hg & I); [exists g; split; [right|]; auto|].
      destruct Hg as [<-|Hg]; [exfalso|exists g; auto].
      apply (Out p f K) with (x := x); auto; intros h y; apply (Exact f); left; auto.
  Qed.
End Crossed.

Lemma holds_sound : forall f m a b r, a < b -> known f a b r -> holds m r = true -> says f m a b.
Proof.
  intros f [| | |] a b r Hab [P B] H; cbn in H |- *; auto.
  - intros x Hx; clear P; induction B as [|p g ps gs K B IH]; [discriminate|].
    cbn in H; apply orb_prop in H as [H|H].
    + exists g; split; [left; auto | apply (body_sound a b p g Hab K H x Hx)].
    + destruct (IH H) as (h & Hh & I); exists h; split; [right; auto | auto].
  - intros x Hx; clear B; induction P as [|p g ps gs K P IH]; intros h Hh; [destruct Hh|].
    cbn in H; apply andb_prop in H as [H1 H2]; destruct Hh as [<-|Hh]; [|apply IH; auto].
    apply (broken_sound a b p g Hab K H1 x Hx).
  - intros Exact; apply orb_prop in H as [H|H]; [left | right]; unfold inside.
    + apply (crossed_sound (fun l => l) comes_once a b Hab comes_once_same) with (parts r); auto.
      intros l g; apply comes_sound; auto.
    + apply (crossed_sound (@rev Z) goes_once a b Hab goes_once_same) with (parts r); auto.
      intros l g; apply goes_sound; auto.
Qed.

(** The leaves of a checked tree cover the interval, and their marks are true. *)
Theorem check_region_sound : forall f r steps leaves, known f 0 1 r ->
  check_region r steps = Some leaves -> tiles mark (says f) 0 1 leaves.
Proof.
  intros f r steps leaves K H.
  apply (check_tree_sound _ _ (cut first_half) (cut second_half) holds (known f) (says f))
    with r steps; auto.
  - intros a b c; apply known_cut; intros; apply first_represents; auto.
  - intros a b c; apply known_cut; intros; apply second_represents; auto.
  - intros m a b c; apply holds_sound.
Qed.

(** ** From polynomials to every point of the tube *)

Section Tube.
  Variables (Point : Type) (tube : R -> Point -> Prop).

  (** Inequalities as sets of points; what their polynomials say of the tube. *)
  Definition about (f : times * times) (i : Point -> Prop) : Prop :=
    forall t q, tube t q -> (0 <= fst f t -> i q) /\ (0 < snd f t -> ~ i q).

  Definition in_region (ps : list (list (Point -> Prop))) (q : Point) : Prop :=
    exists p, In p ps /\ forall i, In i p -> i q.

  Theorem no_tube : forall f ps a b, Forall2 (Forall2 about) (m_parts f) ps ->
    says f No a b -> forall t q, a <= t <= b -> tube t q -> ~ in_region ps q.
  Proof.
    intros f ps a b F S t q Ht Tq (p & Hp & I); specialize (S t Ht); cbn in S.
    induction F as [|g p' gs ps' K F IH]; [destruct Hp|].
    destruct Hp as [->|Hp]; [|apply IH; auto; intros; apply S; right; auto].
    destruct (S g (or_introl eq_refl)) as (h & Hh & P); clear - K Hh P I Tq.
    induction K as [|f i fs is A K IH]; [destruct Hh|].
    destruct Hh as [->|Hh]; [|apply IH; auto; intros; apply I; right; auto].
    destruct (A t q Tq) as [_ N]; apply (N P), I; left; auto.
  Qed.

  (** A body within the region, with the polynomials of its inequalities. *)
  Theorem must_tube : forall f ps a b,
    (forall g, In g (m_bodies f) -> forall t q, tube t q ->
      (forall h, In h g -> 0 <= h t) -> in_region ps q) ->
    says f Must a b -> forall t q, a <= t <= b -> tube t q -> in_region ps q.
  Proof.
    intros f ps a b B S t q Ht Tq; destruct (S t Ht) as (g & Hg & H); eauto.
  Qed.
End Tube.

(** Two parts at a face: where no point is beyond both of two inequalities, what is
    left of the parts without these lies in the two parts together. *)
Theorem across_face : forall (X : Type) (g h : X -> R) (A B : list (X -> R)) x,
  (g x <= 0 \/ h x <= 0) -> (forall f, In f (A ++ B) -> f x <= 0) ->
  (forall f, In f (g :: A) -> f x <= 0) \/ (forall f, In f (h :: B) -> f x <= 0).
Proof.
  intros X g h A B x [L|L] H; [left | right]; intros f [<-|Hf]; auto; apply H, in_or_app; auto.
Qed.

(** Half-spaces n.x <= a and -k n.x <= b with b >= -k a leave no point beyond both. *)
Theorem faces_meet : forall v k a b, 0 < k -> - k * a <= b -> v - a <= 0 \/ - k * v - b <= 0.
Proof. intros v k a b Hk H; destruct (Rle_lt_dec v a); [left; lra | right; nra]. Qed.

(** ** Limits: one polynomial that is nowhere negative *)

Definition check_nonneg (l : list Z) (steps : list (step unit)) : bool :=
  match check_tree _ _ first_half second_half (fun _ => all_nonneg) l steps with
  | Some (_ :: _) => true
  | _ => false
  end.

Theorem check_nonneg_sound : forall l f steps, represents l f 0 1 ->
  check_nonneg l steps = true -> always (fun x => 0 <= f x) 0 1.
Proof.
  intros l f steps K H x Hx; unfold check_nonneg in H.
  destruct (check_tree _ _ _ _ _ _ _) as [[|p leaves]|] eqn:E; try discriminate.
  pose proof (check_tree_sound _ _ first_half second_half (fun _ : unit => all_nonneg)
    (fun a b c => represents c f a b) (fun _ a b => always (fun x => 0 <= f x) a b)) as T.
  specialize (T (fun a b c => first_represents c f a b) (fun a b c => second_represents c f a b)
    (fun _ a b c L R => all_nonneg_sound c f a b L R) _ _ _ K E).
  destruct (tiles_cover _ _ _ _ _ x T Hx) as (m & k & d & _ & B & S); [discriminate|].
  apply S; auto.
Qed.
